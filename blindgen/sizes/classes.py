# Licensed under the Apache License, Version 2.0.
"""
Which of the library's effects data cannot part from one another, by the generator's information.

The cosine of two changes is taken beyond all that the unknowns of the case explain, at the place
and the size of the rival that come nearest: of a change u and the rival w of the size that leaves
least, cos^2 = 1 - |u - w|^2 / |u|^2. From SAME on they count as one. It is fixed in the sealed
label of each case, before any tool has run.
"""
from functools import lru_cache

from blindgen.effects.base import EFFECTS
from blindgen.sizes.predict import SEED, simulated, size_for
import numpy as np
from scipy.optimize import minimize_scalar

SAME = 0.98
WORTH = 0.8                 # cosines from here on are kept
NEARLY = 0.7                # cosines from here on are fitted
DRAWS, LAWS = 4, 2          # of the free numbers of a rival, and of a law, at each place
SMALL = 5.0                 # d', with nothing unknown, below which a change turns with its sign
NEAR, ROUNDS = 1.25, 8      # of the size of the effect, in which a rival is brought to it
RECORDS = 3                 # simulated with and without an effect, with equal seeds
FACTOR, SIZES, TURNS = 4.0, 5, 5    # by which a size is moved at most, in so many sizes; fit
SPECTRAL = ('spectrum', 'rounding')


def rivals(knowledge, name, parameters, alone, seed=0):
    """
    Return {effect: cosine} of the effects whose change is like that of an effect, from WORTH on.

    Effects that no change of a spectrum shows (sines, pulses, modulation, drift, clipping limits,
    missing samples) have no rival.
    """
    craft, effect = knowledge.record.scenario.craft, EFFECTS[name]
    if effect.predict not in (*SPECTRAL, 'simulated') or alone < 0.5:
        return {}
    scenario, rng, best = knowledge.record.scenario, np.random.default_rng(seed), {}
    of = {False: _exact, True: _simulated}
    changed = lru_cache(lambda by_records: of[by_records](
        knowledge, effect.apply(scenario, parameters)))

    def near(rival, start):
        by_records = 'simulated' in (effect.predict, rival.predict)
        return _fitted(knowledge, rival, changed(by_records), start, of[by_records])

    hinges, by_records = None, effect.predict == 'simulated'
    u = changed(by_records).mean(axis=0)
    cosine = knowledge.cosines_with(u)

    def change(scenario):
        """Return the change to a scenario, of which simulations show what the unknowns do."""
        w = knowledge.record.change(scenario)
        return knowledge.seen(w) if by_records else w

    for rival in EFFECTS.values():
        if not rival.library or rival.name == name or not rival.fits(craft):
            continue
        if rival.predict in SPECTRAL:
            starts = [_closest(knowledge.record, rival, u, change, cosine, rng)]
        elif rival.predict == 'simulated' and effect.site == 'structure':
            hinges = hinges or _hinges(knowledge, near, alone)
            starts = [(like, {**rival.draw(rng, craft, knowledge.record.duration_s), **v}, m)
                      for like, v, m in hinges for _ in range(LAWS)]
        else:
            continue
        found = max((near(rival, start) for start in starts if start[0] >= NEARLY), default=0.0)
        if found >= WORTH:
            best[rival.name] = round(float(found), 4)
    return best


def same(found):
    """Return the sorted names of rivals that count as one with the effect."""
    return sorted(name for name, cosine in found.items() if cosine >= SAME)


def _exact(knowledge, scenario):
    """Return the change (1, n) to a scenario."""
    return knowledge.record.change(scenario)[None]


def _simulated(knowledge, scenario):
    """Return the changes (k, n) to a scenario in pairs of records of k seeds."""
    return np.array([simulated(knowledge, scenario, SEED + k) for k in range(RECORDS)])


def _square(knowledge, u):
    """
    Return |u|^2 of changes (k, n) beyond the unknowns.

    What is left of chance between two records of one seed would count as a difference: of
    simulations only those of different seeds are multiplied.
    """
    if len(u) == 1:
        return knowledge.inner(u[0], u[0])
    total = u.sum(axis=0)
    own = sum(knowledge.inner(each, each) for each in u)
    return (knowledge.inner(total, total) - own) / (len(u) * (len(u) - 1))


def _small(u):
    """Return whether a change turns with its sign: a line that moves by its width does not."""
    return float(np.sqrt(u @ u)) < SMALL


def _fitted(knowledge, rival, u, start, of):
    """Return the cosine of changes u with a rival (cosine, numbers, size) of the best size."""
    _, v, m = start
    scenario, whole = knowledge.record.scenario, _square(knowledge, u)
    if whole <= 0.0:
        return 0.0
    signs = (1, -1) if 'sign' in v and _small(u.mean(axis=0)) else (1,)

    def left(log_m):
        try:
            w = of(knowledge, rival.apply(scenario, rival.size(v, float(np.exp(log_m)))))
        except ArithmeticError:         # a motion that grows without end
            return np.inf
        return min(_square(knowledge, u - sign * w) for sign in signs)
    ahead = np.clip(np.log(m) + np.log(FACTOR) * np.linspace(-1, 1, SIZES), np.log(rival.low),
                    np.log(rival.high))
    found = [left(log_m) for log_m in ahead]
    k = int(np.argmin(found))
    bounds = ahead[max(k - 1, 0)], ahead[min(k + 1, SIZES - 1)]
    least = min(found[k], minimize_scalar(left, bounds=bounds, method='bounded',
                                          options={'maxiter': TURNS}).fun)
    return np.sqrt(np.clip(1 - least / whole, 0.0, 1.0))


def _closest(record, rival, u, change, cosine, rng):
    """
    Return the cosine, numbers and size of a rival about as large, of the best place and draw.

    `change(scenario)` is that to another scenario, `cosine(change)` that with the change u.
    """
    scenario, best, done = record.scenario, (0.0, None, None), {}
    m, trial = np.sqrt(rival.low * rival.high), float(np.sqrt(u @ u))
    for _ in range(200):
        v = rival.draw(rng, scenario.craft, record.duration_s)
        place = tuple(v.get(key) for key in ('source', 'channel', 'array', 'sign'))
        free = {'f', 'along', 'angle', 'tau'} & set(v)
        if done.get(place, 0) >= (DRAWS if free else 1):
            if sum(done.values()) > 40 or not free and len(done) > 30:
                break
            continue
        done[place] = done.get(place, 0) + 1
        if v.get('sign') == -1.0 and _small(u):
            v['sign'] = 1.0
        for _ in range(ROUNDS):
            w = change(rival.apply(scenario, rival.size(v, m)))
            size = np.sqrt(w @ w)
            if trial / NEAR < size < trial * NEAR:
                break
            m = float(np.clip(m * np.clip(trial / max(size, 1e-12), 1e-3, 1e3), rival.low,
                              rival.high))
        best = max(best, (abs(cosine(w)), v, m), key=lambda each: each[0])
    return best


def _hinges(knowledge, near, alone):
    """
    Return cosine, place and size of the linear hinge of every array that is about as large.

    `near(effect, start)` is the cosine of the best size; no law can be far from the linear hinge.
    """
    linear, starts = EFFECTS['hinge_compliance'], []
    for name in knowledge.record.scenario.craft.names:
        v = {'array': name}
        m = 1 / size_for(knowledge, linear.name, v, alone)[0]['stiffness_n_m_rad']
        starts.append((near(linear, (1.0, v, m)), v, m))
    return starts
