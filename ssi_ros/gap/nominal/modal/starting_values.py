"""
Which forms are fitted, and where their fits begin.

Where channels follow each other closely, as under one shaker, a likelihood over a gain or a delay
falls off as a logarithm: its slope at null gives the direction and not the distance. There a grid
of sizes is tried.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import modal_forms
from ssi_ros.gap.inference.goodness_of_fit import divergence
from ssi_ros.gap.nominal.forms import excitation, structure
from ssi_ros.gap.nominal.forms.sensor import mode_picks
from ssi_ros.gap.nominal.modal.prediction import predict
from ssi_ros.gap.nominal.modal.reference import moves
from ssi_ros.scipy_later import minimize_scalar

SITES = (excitation, structure)     # whose modules enter their forms in the registry
EACH = 2                # places of one effect that are fitted
FINALISTS = 12          # forms fitted after the scores
RIDGE = 1e-6            # of the largest weight of a mode: one that no band holds stays
GRID = 3.0              # ratio of sizes that are tried
SIZES = 10              # of either sign
MOST_BANDS = 200        # that the grid uses
IMPOSSIBLE = 1e9        # nats of what is no spectrum
CLOSER = 3e-3           # share of a range of sizes to which the nearest is known
BESIDE = 1.1            # ratio of sizes that all bands are asked about


def all_forms(nominal, names=None):
    """Return every form of the effects called `names` (all if None) for a nominal."""
    forms = [replace(f, effect=name, variants=tuple(replace(v, effect=name) for v in f.variants))
             for name, function in modal_forms().items() for f in function(nominal)]
    like = [(f.effect, len(f.numbers)) for f in forms]
    forms = [replace(f, places=like.count(kind)) for f, kind in zip(forms, like)]
    return tuple(f for f in forms if names is None or {f.effect, *f.equivalents} & set(names))


def best_forms(test):
    """Return the forms of the largest gains of a score test, a few places of each effect."""
    gains = dict(zip(test.labels, test.gains))
    chosen, count = [], {}
    for form in sorted(gains, key=lambda f: -gains[f]):
        if count.get(form.effect, 0) < EACH and len(chosen) < FINALISTS:
            count[form.effect] = count.get(form.effect, 0) + 1
            chosen.append(form)
    return chosen


def nearest_forms(recordings, forms):
    """Return the forms of one number that are nearest to the record, at their best sizes."""
    nominal, one, two = recordings.nominal, recordings.one, recordings.two
    tried = [bracketed(nominal, v, two.mean, one.freedom, two.freedom)
             for f in forms if len(f.numbers) == 1 for v in (f, *f.variants)]
    best = {}
    for form, away in sorted(tried, key=lambda t: t[1]):
        if away < IMPOSSIBLE:
            best.setdefault(form.effect, []).append((form, away))
    chosen = [t for some in best.values() for t in some[:EACH]]
    chosen = [form for form, _ in sorted(chosen, key=lambda t: t[1])[:FINALISTS]]
    return chosen if nominal.levels is not None else [
        refined(nominal, f, BESIDE, two.mean, one.freedom, two.freedom)[0] for f in chosen]


def moved_forms(nominal, record_modes, forms):
    """Return the forms that move modes, begun where the modes of the record are."""
    way = 2 * moves(nominal.modes, record_modes)
    if not way.any():
        return []
    found = [replace(f, begin=[np.median(way[way != 0.0])]) for f in forms
             if f.pattern is ModalPattern.COMMON_FREQUENCY_RATIO]
    return found + [replace(f, begin=way) for f in forms
                    if f.each_mode and f.pattern is ModalPattern.MODE_FREQUENCIES]


def thinned(nominal, most=MOST_BANDS):
    """Return a nominal of some bands, evenly chosen, and which they are."""
    step = -(-nominal.cut.bands // most)
    which = np.arange(0, nominal.cut.bands, step)
    chosen = tuple(np.array(nominal.cut.chosen)[which])
    return replace(nominal, cut=replace(nominal.cut, chosen=chosen),
                   spectrum=nominal.spectrum[which], trust=nominal.trust[which]), which


def distance(nominal, forms, numbers, observed, n_one, n_two):
    """Return the mean distance where level fits best and no noise is added, and that level."""
    predicted = predict(nominal, forms, np.append([0.0, 0.0], numbers))
    if not predicted.possible:
        return IMPOSSIBLE, 0.0
    ratio = np.einsum('bii->b', np.linalg.solve(predicted.mean, observed)).real
    ratio = ratio / observed.shape[-1]
    level = float(np.log(max(np.median(ratio), 1e-300)))
    bands = divergence(np.exp(level) * predicted.mean, observed, n_one, n_two)
    return float(np.mean(nominal.trust * bands)), level


def bracketed(nominal, form, observed, n_one, n_two):
    """Return a form of one number, begun near its best size, and the mean distance there."""
    some, which = thinned(nominal)
    number, observed = form.numbers[0], observed[which]
    sizes = number.start / GRID * GRID ** np.arange(SIZES)
    sizes = np.concatenate([-sizes[::-1], sizes])
    sizes = sizes[(sizes > number.low) & (sizes < number.high)]
    values = [distance(some, (form,), [x], observed, n_one, n_two)[0] for x in sizes]
    best = int(np.argmin(values))
    if values[best] >= IMPOSSIBLE:
        return form, IMPOSSIBLE
    return refined(some, replace(form, begin=sizes[best:best + 1]), GRID, observed, n_one, n_two)


def refined(nominal, form, ratio, *observed):
    """Return a form of one number, begun where it is nearest to the record, and the distance."""
    number, x = form.numbers[0], form.begin[0]
    ends = sorted(np.clip([x / ratio, x * ratio], number.low, number.high))
    found = minimize_scalar(
        lambda at: distance(nominal, (form,), [at], *observed)[0], bounds=ends, method='bounded',
        options={'xatol': CLOSER * (ends[1] - ends[0]), 'maxiter': 20})
    return replace(form, begin=np.array([found.x])), float(found.fun)


def begun(nominal, form, observed):
    """Return the form of changed shapes at a channel, begun at what cross spectra say, (181)."""
    # The other channels stay, so that the cross spectra of this one with them are linear in its
    # row, however far it moved, and its noise is not in them.
    c = nominal.channels.index(form.place['channel'])
    others = [k for k in range(len(nominal.channels)) if k != c]
    grid = np.ix_(np.arange(nominal.cut.bands), others, others)
    usual = nominal.spectrum
    inverse = np.linalg.inv(usual[grid])
    # their level, without the channel in doubt
    level = np.median(np.einsum('bij,bji->b', inverse, observed[grid]).real / len(others))
    missing = observed[:, c][:, others] / level - usual[:, c][:, others]
    # what a mode more of it would add: rows of spectra without the noise of the others
    clean = usual - np.diag(nominal.floor)
    rows = np.einsum('mbi,bij->mbj', mode_picks(nominal), clean)[:, :, others]
    root = np.linalg.cholesky(inverse) * np.sqrt(
        nominal.trust / usual[:, c, c].real)[:, None, None]
    target = np.einsum('bj,bjk->bk', missing, root).reshape(-1)
    rows = np.einsum('mbj,bjk->mbk', rows, root).reshape(len(rows), -1)
    normal = (rows.conj() @ rows.T).real
    normal += RIDGE * np.diag(normal).max() * np.eye(len(normal))
    return replace(form, begin=np.linalg.solve(normal, (rows.conj() @ target).real))
