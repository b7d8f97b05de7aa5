"""
Whether impulses follow the motion: a contact in the structure, no force from outside.

Impulses from outside are independent of the motion just before them; a contact comes where a
displacement is extreme, or where parts meet fast. The mean of the motion before n events is that
of the same events at all other times by chance, whatever their intervals are. What earlier
impulses left ringing is taken out of the motion, for trains of them come in its phase.
"""
from itertools import product

import numpy as np
from scipy.fft import irfft, rfft

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.base import Site
from ssi_ros.events.common_shape import ALIKE, learn, matched, MOST, places, SHAPE, steady
from ssi_ros.gap.comparison import Detection, LEAST_CHANCE
from ssi_ros.past_motion import DISPLACEMENT, integrated, over_level, points_of, VELOCITY
from ssi_ros.scipy_later import maximum_filter1d
from ssi_ros.tails import chi2

ONSET = 1e-4            # chance of noise by which a shape has begun
MORE = 1, 2             # times the events that are larger than all of the reference
FEWEST = 8              # events whose mean is Gaussian
SIDE = SHAPE // 3       # rows beside an event in which its shape is like itself
LOUD = 0.8              # of the largest of the reference, which leaves motion behind it
HUGE = 3.0              # likewise
CORNERS = 0.5, 1.0, 2.0     # of the integrals, over the slowest mode
SHORTEST = 8000         # rows of a recording, of which halves show a shape
LONGEST = 400_000       # rows in which contacts are looked for, an hour at 100 Hz
FOLLOWS = 1e-4          # p-value below which impulses follow the motion


def events_of(reference, record):
    """
    Return rows at which events begin, their signs, how many are sure, and what is loud.

    Of two white errors (n, l): those of one shape, learnt in one half of the record and looked for
    in the other, the largest over the largest of the reference first. Loud is what is nearly as
    large, also next to a larger one: sizes, rows and shapes, the largest first.
    """
    reference, record = steady(reference), steady(record)
    middle, found, loud = len(record) // 2, [], []
    halves = record[:middle], record[middle:]
    shapes = _aligned(*map(learn, halves))
    for shape, tried, offset in zip(shapes, halves[::-1], (middle, 0)):
        match = matched(tried, shape)
        sizes = np.abs(match) / np.abs(matched(reference, shape)).max()
        at = places(sizes, MOST)
        found += zip(at + offset, np.sign(match[at]), sizes[at])
        # just before a large one is what its own shape makes of it
        beside = maximum_filter1d(sizes, 2 * SIDE + 1)
        loud += [(sizes[k], k + offset, shape)
                 for k in np.flatnonzero((sizes > LOUD) & (sizes == beside))]
    rows, signs, sizes = np.array(sorted(found, key=lambda f: -f[2])).T
    return rows.astype(int), signs, int(np.count_nonzero(sizes > 1)), sorted(
        loud, key=lambda f: -f[0])


def _aligned(first, second):
    """Return two shapes of one event, (r, l) each, of one sign, from where it begins."""
    alike = matched(np.pad(first, ((SHAPE // 2, SHAPE // 2), (0, 0))), second)
    best = int(np.argmax(np.abs(alike)))
    second = second * np.sign(alike[best])
    late = best - SHAPE // 2
    first, second = first[max(late, 0):], second[max(-late, 0):]
    rows = min(len(first), len(second))
    first, second = first[:rows], second[:rows]
    # before it begins a shape is the mean of noise
    energy = ALIKE * (first ** 2 + second ** 2).sum(axis=1)
    begins = np.argmax(energy > chi2.isf(ONSET, 2 * first.shape[1]))
    return first[begins:], second[begins:]


def quiet(way, errors, loud):
    """Return the motion (n, l) over its rms, without shapes in what comes new at rows."""
    errors = errors.copy()
    for size, k, shape in loud:
        there = errors[k:k + len(shape)]
        # of a huge one even what differs from the shape would ring
        there -= there if size > HUGE else (
            np.vdot(there, shape) / np.vdot(shape, shape) * shape)
    new, order = np.linalg.solve(way.lower, errors.T).T, len(way.weights)
    past = np.concatenate(way.weights[::-1])
    values = np.pad(new, ((order, 0), (0, 0)))
    for k in range(order, len(values)):
        values[k] += values[k - order:k].ravel() @ past
    return values[order:]


def motions(values, rate_hz, corner_hz, integrals):
    """Return integrals of accelerations (n, l) by the past alone, (n, q), and their channels."""
    count, width = values.shape
    found = integrated(rfft(values - values.mean(axis=0), 2 * count, axis=0), count, rate_hz,
                       corner_hz, integrals)
    points = points_of(width)
    found = np.column_stack([found, *(found[:, i] - found[:, j] for i, j in points[width:])])
    return np.transpose([over_level(m) for m in found.T]), points


def follows(spectra, count, rows, signs, width):
    """
    Return the p-value of the mean motion before events, and the column that shows it best.

    Parameters
    ----------
    spectra : ndarray, shape (n // 2 + 1, q)
        Fourier transforms of the motion of channels, and of differences of two of them.
    count : int
        The n rows of the motion.
    rows : ndarray of int, shape (e,)
        Before which events begin.
    signs : ndarray, shape (e,)
        That the motion is taken with.
    width : int
        How many columns are channels.

    """
    weights = np.zeros(count)
    weights[rows - 1] = signs
    # at all turns of the events against the motion
    means = irfft(np.conj(rfft(weights))[:, None] * spectra, count, axis=0)
    away = means[0] - means.mean(axis=0)
    covariance = np.cov(means[:, :width].T).reshape(width, width)
    size = away[:width] @ np.linalg.pinv(covariance, hermitian=True) @ away[:width]
    return (float(chi2.sf(size, np.linalg.matrix_rank(covariance, hermitian=True))),
            int(np.argmax(np.abs(away) / means.std(axis=0))))


def contact(residuals, predicted, rate_hz, slowest_hz, channels):
    """
    Return the p-value of impulses that follow the motion, and where they come, in words.

    Parameters
    ----------
    residuals : sequence of two ndarray, shape (n - k, l)
        White errors of the reference and of the record, in which impulses are looked for.
    predicted : tuple of Predictor, ndarray (n - k, l)
        Of the record: its prediction and the errors of that.
    rate_hz, slowest_hz : float
        Of the samples, and of the slowest mode.
    channels : sequence of str
        Names of the l channels.

    """
    rows, signs, sure, loud = events_of(*residuals)
    later = rows > 0
    rows, signs, sure = rows[later], signs[later], max(sure, FEWEST)
    way, errors = predicted
    values = quiet(way, errors, loud) * way.scale
    found = []
    for integrals, corner in product((DISPLACEMENT, VELOCITY), CORNERS):
        motion, points = motions(values, rate_hz, corner * slowest_hz, integrals)
        spectra = rfft(motion, axis=0)
        # a stop on one side pushes one way; of two, each pushes its own
        for times, turn in ((t, s) for t in MORE for s in (np.ones(len(signs)), signs)):
            p_value, at = follows(spectra, len(motion), rows[:times * sure],
                                  turn[:times * sure], len(channels))
            found.append((p_value, integrals, points[at]))
    p_value, integrals, point = min(found)
    names = [channels[i] for i in point]
    where = {(1, DISPLACEMENT): 'channel {} is far to one side',
             (1, VELOCITY): 'channel {} moves fast one way',
             (2, DISPLACEMENT): 'channels {} and {} are far apart',
             (2, VELOCITY): 'channels {} and {} move fast against each other'}
    return min(1.0, len(found) * p_value), where[len(point), integrals].format(*names)


def contact_of(recordings, detections):
    """Return the Detection of impulses that follow the motion, in a tuple that may be empty."""
    impulses = [d for d in detections if _from_outside(d.effect)]
    if not impulses or recordings.repeats is not None or (
            min(map(len, recordings.slew_normalised)) < SHORTEST):
        return ()
    slowest = min((m.frequency_hz for m in recordings.nominal.identified),
                  default=recordings.full_cut.middles_hz[0])
    reference, record = recordings.slew_normalised
    p_value, where = contact(
        (reference, record[:LONGEST]),
        (recordings.predictors[1][1], recordings.prediction_errors[1][:LONGEST]),
        recordings.pair.rate_hz, slowest, recordings.pair.channels)
    if not p_value < FOLLOWS:
        return ()
    # that there are impulses, and that they come where they do, are independent
    both = max(p_value * min(d.p_value for d in impulses), LEAST_CHANCE)
    text = f'The impulses come where {where}: a contact in the structure, no force from outside.'
    return (Detection('', {}, float(both * (1 - np.log(both))), text, site=Site.STRUCTURE.value),)


def not_from_outside(detections):
    """Return detections without those of impulses from outside, in a tuple."""
    return tuple(d for d in detections if not _from_outside(d.effect))


def makes_contact(names):
    """Return whether one of these effects is itself a contact in the structure."""
    return any(ModalPattern.IMPULSES in effect_class(n).patterns and not _from_outside(n)
               for n in names)


def _from_outside(name):
    effect = effect_class(name)
    return ModalPattern.IMPULSES in effect.patterns and effect.site is Site.EXCITATION
