"""
Pulses in a record that the reference does not have, by their size and by their shape, (161).

A pulse that is far from the channels arrives as a wave of many samples, each below the noise. But
all pulses from one place have one shape: what the loudest in one half of a record look like is
sought in the other half, which knows nothing of it.
"""
import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.signal import fftconvolve
from scipy.stats import t as student

from ssi_ros.gap.reference.coupled import matrix_power
from ssi_ros.gap.reference.extra import excess
from ssi_ros.gap.reference.forms import Form, Number
from ssi_ros.gap.reference.innovation import PREDICTED
from ssi_ros.gap.reference.signs import NEVER, Sign, WINDOWS

PULSE = 5.0             # standard deviations beyond which a residual is a pulse
FEWEST = 3              # samples or pulses
SURE = 1e-3
SHAPE = 96              # samples of a pulse, at most
BURST = 16              # samples in which the loudest places are sought
BEGUN = 4               # of them, with which shapes begin
ALIKE = 24              # of the best matches, of which the next shape is the mean
TURNS = 6               # of learning
LEVEL = 10              # shapes around one over which the level is taken
MOST = 400              # pulses that are counted


def pulses(left_one, left_two, rate_hz):
    """
    Compare pulses in what the past does not predict, eq. (161) and (161a).

    Parameters
    ----------
    left_one, left_two : ndarray, shape (n, l)
        Residuals of reference and record, white and of unit variance.
    rate_hz : float
        Their rate [Hz].

    Returns
    -------
    Sign or None

    """
    left_one, left_two = _steady(left_one), _steady(left_two)
    both = [(2 * p, count, text) for p, count, text in (
        _large(left_one, left_two), _shaped(left_one, left_two))]
    seen = [f for f in both if f[0] < SURE and f[1] >= FEWEST]
    if not seen:
        return None
    # those that stand out by themselves are counted best
    _, count, text = seen[0]
    p = min(f[0] for f in seen)
    rate = 60 * rate_hz * count / len(left_two)
    return Sign('impulsive_events', {}, {'rate_per_min': (float(rate), '1/min')},
                float(max(p, NEVER)), text)


def _large(left_one, left_two):
    """Return chance, count and words of samples that stand out, by their fourth moment."""
    before, after = _peaked(left_one), _peaked(left_two)
    z = (after[0] - before[0]) / np.hypot(after[1], before[1])
    sizes = np.sqrt((left_two ** 2).mean(axis=1))
    beyond = np.flatnonzero(sizes > _threshold(left_one))
    # few events are few degrees of freedom for a moment; but where nothing parts the recordings
    # each of the largest is in either by its length
    events = np.count_nonzero(np.diff(beyond, prepend=-PREDICTED - 1) > PREDICTED)
    p = min(float(student.sf(z, 20)), (len(left_two) / (len(left_one) + len(left_two))) ** events)
    return p, len(beyond), f'{len(beyond)} samples are unpredictable beyond all of the reference'


def _threshold(left):
    """Return a size of residuals that a recording without pulses hardly reaches."""
    sizes = np.sqrt((left ** 2).mean(axis=1))
    return max(sizes.max(), sizes.mean() + PULSE * sizes.std())


def _peaked(left):
    """Return the fourth moment over that of a Gaussian, and its spread from 20 blocks."""
    power = (left ** 2).mean(axis=1)
    blocks = np.array([np.mean(b ** 2) / np.mean(b) ** 2 for b in np.array_split(power, 20)])
    return blocks.mean(), blocks.std(ddof=1) / np.sqrt(20)


def _shaped(left_one, left_two):
    """Return chance, count and words of pulses of one shape, learnt in one half of the record."""
    middle = len(left_two) // 2
    if middle < 2 * ALIKE * SHAPE:
        return 1.0, 0, ''
    halves = left_two[:middle], left_two[middle:]
    count = 0
    for learnt, tried in (halves, halves[::-1]):
        shape = learn(learnt)
        beyond = np.abs(matched(left_one, shape)).max()
        sizes = np.abs(matched(tried, shape))
        count += np.count_nonzero(sizes[_places(sizes, MOST)] > beyond)
    # the largest of a half and of the reference are in the half by its length, each time anew
    own = middle / (middle + len(left_one))
    return (own ** count * (1 + count * (1 - own)), count,
            f'{count} events of one shape are larger than all of that shape in the reference')


def _steady(left):
    """Return residuals over their level around: the crests of one that swings are no pulses."""
    around = max(LEVEL * SHAPE, len(left) // WINDOWS)
    return left / np.sqrt(uniform_filter1d((left ** 2).mean(axis=1), around))[:, None]


def learn(left):
    """
    Return the shape that the loudest events have in common, (SHAPE, l).

    Each of the loudest places begins one: it is sought everywhere, and the mean of the best
    matches, turned to one sign, is the next.
    """
    half = SHAPE // 2
    burst = uniform_filter1d((left ** 2).sum(axis=1), BURST)[half:-half]
    best = (-1.0, None)
    for start in _places(burst, BEGUN):
        shape = left[start:start + SHAPE]
        for _ in range(TURNS):
            match = matched(left, shape)
            at = _places(np.abs(match), ALIKE)
            shape = np.mean([np.sign(match[k]) * left[k:k + SHAPE] for k in at], axis=0)
        best = max(best, (float(np.abs(match[at]).mean()), shape), key=lambda b: b[0])
    return best[1]


def matched(left, shape):
    """Return how much of a shape begins at each row, of unit variance in white noise."""
    return fftconvolve(left, shape[::-1], 'valid', axes=0).sum(axis=1) / np.linalg.norm(shape)


def _places(sizes, most):
    """Return the places of the largest values, each the largest within a shape."""
    tops = np.flatnonzero(sizes == maximum_filter1d(sizes, 2 * SHAPE + 1))
    return tops[np.argsort(-sizes[tops])][:most]


def of_pulses(sign, predictor, record, base, two):
    """
    Return the forms of pulses: the spectrum of their shape, whose power is one number, (161b).

    And what the record has beyond the level, for pulses of no one shape: there each number of
    their spectrum is measured, and paid for.

    Parameters
    ----------
    sign : Sign
        What was seen.
    predictor : Predictor
        Of the record.
    record : ndarray, shape (n, l)
        The record.
    base : Fitted
        Level and noise alone.
    two : Spectra
        Of the record.

    Returns
    -------
    list of Form

    """
    left = predictor.residual(record)
    shape = learn(_steady(left))
    shape = shape / np.linalg.norm(shape)
    sizes = np.abs(matched(left, shape))
    count = sign.numbers['rate_per_min'][0] / 60 * len(left) / two.cut.rate_hz
    heights = sizes[_places(sizes, max(int(np.rint(count)), 1))]
    power = np.sum(np.maximum(heights ** 2 - 1, 0.0)) / len(left)
    cycles = two.cut.middles_hz / two.cut.rate_hz
    way = predictor.shaping(cycles)
    # the bands know the resonances better than the prediction does
    root = matrix_power(way @ way.conj().swapaxes(-1, -2), 0.5)
    back = np.linalg.inv(root)
    way = back @ matrix_power(root @ two.mean @ root, 0.5) @ back @ way
    turns = np.exp(-2j * np.pi * np.outer(cycles, np.arange(SHAPE)))
    pulse = np.einsum('bij,bj->bi', way, turns @ shape)
    added = power * pulse[:, :, None] * pulse[:, None, :].conj() / np.exp(base.x[0])
    any_shape = excess(base, two.mean)
    return [Form(sign.effect, sign.place, (Number('relative_power', '1', 1.0, 0.0, 100.0),),
                 lambda n, x: (None, x[0] * added), sign.text, constants=sign.numbers),
            Form(sign.effect, sign.place, (), lambda n, x: (None, any_shape), sign.text,
                 constants=sign.numbers, measured=any_shape.size / 3)]
