"""
Find where the fit of a form shall begin, by distances on a grid of sizes.

Where channels follow each other closely, as under one shaker, a likelihood over a gain or a delay
falls off as a logarithm: its slope at null tells the direction and not the way.
"""
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from ssi_ros.gap.reference.distance import divergence
from ssi_ros.gap.reference.fit import predict

GRID = 3.0              # ratio of sizes that are tried
SIZES = 10              # of either sign
MOST_BANDS = 200        # that the grid looks at
IMPOSSIBLE = 1e9        # nats of what is no spectrum
CLOSER = 1e-2           # share of a size to which it is refined


def thinned(nominal, most=MOST_BANDS):
    """Return a nominal of some bands, evenly chosen, and which they are."""
    step = -(-nominal.cut.bands // most)
    which = np.arange(0, nominal.cut.bands, step)
    chosen = tuple(np.array(nominal.cut.chosen)[which])
    return replace(nominal, cut=replace(nominal.cut, chosen=chosen),
                   spectrum=nominal.spectrum[which], trust=nominal.trust[which]), which


def distance(nominal, forms, numbers, seen, n_one, n_two):
    """Return the mean distance where level fits best and no noise is added, and that level."""
    predicted = predict(nominal, forms, np.append([0.0, 0.0], numbers))
    if not predicted.possible:
        return IMPOSSIBLE, 0.0
    ratio = np.einsum('bii->b', np.linalg.solve(predicted.mean, seen)).real / seen.shape[-1]
    level = float(np.log(max(np.median(ratio), 1e-300)))
    bands = divergence(np.exp(level) * predicted.mean, seen, n_one, n_two)
    return float(np.mean(nominal.trust * bands)), level


def bracketed(nominal, form, seen, n_one, n_two):
    """
    Return a form with one number that begins near its best size, and the distance there.

    Parameters
    ----------
    nominal : Nominal
        The reference.
    form : Form
        With one number.
    seen : ndarray, shape (b, l, l)
        Mean spectrum of the record.
    n_one, n_two : float
        Independent spectra behind both.

    Returns
    -------
    form : Form
        With `begin`.
    left : float
        Mean distance of the thinned bands.

    """
    some, which = thinned(nominal)
    number, seen = form.numbers[0], seen[which]

    def left(x):
        return distance(some, (form,), [x], seen, n_one, n_two)[0]
    sizes = number.start / GRID * GRID ** np.arange(SIZES)
    sizes = np.concatenate([-sizes[::-1], sizes])
    sizes = sizes[(sizes > number.low) & (sizes < number.high)]
    values = [left(x) for x in sizes]
    best = int(np.argmin(values))
    if values[best] >= IMPOSSIBLE:
        return form, IMPOSSIBLE
    x = sizes[best]
    ends = sorted(np.clip([x / GRID, x * GRID], number.low, number.high))
    found = minimize_scalar(left, bounds=ends, method='bounded',
                            options={'xatol': CLOSER * abs(x), 'maxiter': 20})
    if found.fun < values[best]:
        x, values[best] = float(found.x), float(found.fun)
    return replace(form, begin=np.array([x])), values[best]
