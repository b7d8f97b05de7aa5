# Licensed under the Apache License, Version 2.0.
"""
Which of the library's effects cannot be data from one another, by the generator's information.

The cosine of two changes of one size is taken beyond all that the unknowns of the case explain,
and the best over the places and the free numbers of the rival. From SAME on they count as one. It
is fixed in the sealed label of each case, before any tool has run.
"""
from blindgen.effects.base import EFFECTS
from blindgen.sizes.predict import PAIRS, SEED, simulated, size_for
import numpy as np

SAME = 0.98
WORTH = 0.8                 # cosines from here on are kept
DRAWS = 4                   # of the free numbers of a rival, at each place
SMALL = 5.0                 # d', with nothing unknown, below which a change turns with its sign
NEAR, ROUNDS = 1.25, 8      # of the size of the effect, in which a rival is brought to it
SPECTRAL = ('spectrum', 'rounding')


def rivals(knowledge, name, parameters, alone, seed=0):
    """
    Return {effect: cosine} of the effects whose change is like that of an effect, from WORTH on.

    Effects that no change of a spectrum shows (sines, pulses, modulation, drift, clipping limits,
    missing samples) have no rival.
    """
    craft, kind = knowledge.record.scenario.craft, EFFECTS[name].predict
    if kind not in (*SPECTRAL, 'simulated') or alone < 0.5:
        return {}
    u = _change(knowledge, EFFECTS[name], parameters)
    cosine, best, rng = knowledge.cosines_with(u), {}, np.random.default_rng(seed)
    trial = float(np.sqrt(u @ u))
    for rival in EFFECTS.values():
        if not rival.library or rival.name == name or not rival.fits(craft):
            continue
        if rival.predict in SPECTRAL:
            found = _closest(knowledge, rival, cosine, trial, rng)
        elif rival.predict == 'simulated' and EFFECTS[name].site == 'structure':
            found = _hinges(knowledge, rival, cosine, alone, rng)
        else:
            continue
        if found >= WORTH:
            best[rival.name] = round(float(found), 4)
    return best


def same(found):
    """Return the sorted names of rivals that count as one with the effect."""
    return sorted(name for name, cosine in found.items() if cosine >= SAME)


def _change(knowledge, effect, parameters):
    scenario = effect.apply(knowledge.record.scenario, parameters)
    if effect.predict == 'simulated':
        return np.mean([simulated(knowledge, scenario, SEED + k) for k in range(PAIRS)], axis=0)
    return knowledge.record.change(scenario)


def _closest(knowledge, rival, cosine, trial, rng):
    """Return the largest cosine of a rival of a size over its places and draws."""
    craft, best, done = knowledge.record.scenario.craft, 0.0, {}
    duration, m = knowledge.record.duration_s, np.sqrt(rival.low * rival.high)
    for _ in range(200):
        v = rival.draw(rng, craft, duration)
        place = tuple(v.get(key) for key in ('source', 'channel', 'array', 'sign'))
        free = {'f', 'along', 'angle', 'tau'} & set(v)
        if done.get(place, 0) >= (DRAWS if free else 1):
            if sum(done.values()) > 40 or not free and len(done) > 30:
                break
            continue
        done[place] = done.get(place, 0) + 1
        # a small change turns with its sign; of a line that moves by its width both are tried
        if v.get('sign') == -1.0 and trial < SMALL:
            v['sign'] = 1.0
        for _ in range(ROUNDS):
            w = knowledge.record.change(rival.apply(knowledge.record.scenario, rival.size(v, m)))
            size = np.sqrt(w @ w)
            if trial / NEAR < size < trial * NEAR:
                break
            m = float(np.clip(m * np.clip(trial / max(size, 1e-12), 1e-3, 1e3), rival.low,
                              rival.high))
        best = max(best, abs(cosine(w)))
    return best


def _hinges(knowledge, rival, cosine, alone, rng):
    """Return the largest cosine of a nonlinear hinge, as large as the effect, in any array."""
    record, best = knowledge.record, 0.0
    for name in record.scenario.craft.names:
        v = rival.draw(rng, record.scenario.craft, record.duration_s)
        v['array'] = name
        compliance = size_for(knowledge, 'hinge_compliance', v, alone)[0]
        p = rival.size(v, 1 / compliance['stiffness_n_m_rad'])
        w = simulated(knowledge, rival.apply(record.scenario, p), SEED)
        best = max(best, abs(cosine(w)))
    return best
