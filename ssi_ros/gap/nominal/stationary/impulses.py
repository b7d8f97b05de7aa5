"""
Pulses in a record that the reference does not have, by their size and by their shape, (161).

A pulse that is far from the channels arrives as a wave of many samples, each below the noise. But
all pulses from one place have one shape: that of the loudest in one half of a record is searched
in the other half, which is independent of it.
"""
from functools import partial

import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import detects
from ssi_ros.events.common_shape import ALIKE, learn, matched, MOST, places, SHAPE, steady
from ssi_ros.events.detector import event_in
from ssi_ros.events.level_around import over_higher
from ssi_ros.events.prediction_error import PREDICTED, predictor
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.stationary.samples import EXACT
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.hermitian import matrix_power, positive
from ssi_ros.tails import student


@detects('impulsive_events', of='recordings')
def impulses(effect, recordings):
    """Detect impulses by their size or by their common shape."""
    event, rate_hz = event_in(effect, recordings), recordings.pair.rate_hz
    found = pulses(*recordings.slew_normalised) if event is None else None
    if found is None:
        return event
    p, count, text = found
    rate = 60 * rate_hz * count / len(recordings.slew_normalised[1])
    return Detection(effect.name, {'rate_per_min': float(rate)}, max(p, EXACT), text,
                     basis=partial(impulse_forms, rate_per_min=float(rate)))


def pulses(*sides):
    """Compare pulses in two white errors (n, l), (161): p-value, count and words, or None."""
    tests = [(2 * p, count, text) for p, count, text in (
        _large(*map(over_higher, sides)), _shaped(*map(steady, sides)))]
    found = [f for f in tests
             if f[0] < LIMITS.detected.value and f[1] >= LIMITS.fewest_pulses.value]
    if not found:
        return None
    # those that stand out by themselves are counted best
    return float(min(f[0] for f in found)), *found[0][1:]


def _large(residual_one, residual_two):
    """Return chance, count and words of samples that stand out, by their fourth moment."""
    before, after = _peaked(residual_one), _peaked(residual_two)
    z = (after[0] - before[0]) / np.hypot(after[1], before[1])
    sizes = np.sqrt((residual_two ** 2).mean(axis=1))
    beyond = np.flatnonzero(sizes > _threshold(residual_one))
    # few events are few degrees of freedom for a moment; but where the recordings do not differ
    # each of the largest is in either by its length
    events = np.count_nonzero(np.diff(beyond, prepend=-PREDICTED - 1) > PREDICTED)
    share = len(residual_two) / (len(residual_one) + len(residual_two))
    p = min(float(student.sf(z, 20)), share ** events)
    return p, len(beyond), f'{len(beyond)} samples are unpredictable beyond all of the reference'


def _threshold(residual):
    """Return a size of residuals that a recording without pulses hardly reaches."""
    sizes = np.sqrt((residual ** 2).mean(axis=1))
    return max(sizes.max(), sizes.mean() + LIMITS.pulse.value * sizes.std())


def _peaked(residual):
    """Return the fourth moment over that of a Gaussian, and its spread from 20 blocks."""
    power = (residual ** 2).mean(axis=1)
    blocks = np.array([np.mean(b ** 2) / np.mean(b) ** 2 for b in np.array_split(power, 20)])
    return blocks.mean(), blocks.std(ddof=1) / np.sqrt(20)


def _shaped(residual_one, residual_two):
    """Return chance, count and words of pulses of one shape, learnt in one half of the record."""
    middle = len(residual_two) // 2
    if middle < 2 * ALIKE * SHAPE:
        return 1.0, 0, ''
    halves = residual_two[:middle], residual_two[middle:]
    count = 0
    for learnt, tried in (halves, halves[::-1]):
        shape = learn(learnt)
        beyond = np.abs(matched(residual_one, shape)).max()
        sizes = np.abs(matched(tried, shape))
        count += np.count_nonzero(sizes[places(sizes, MOST)] > beyond)
    # the largest of a half and of the reference are in the half by its length, each time anew
    own = middle / (middle + len(residual_one))
    return (own ** count * (1 + count * (1 - own)), count,
            f'{count} events of one shape are larger than all of that shape in the reference')


def impulse_forms(recordings, rate_per_min):
    """Return the forms of pulses: the spectrum of their shape, one number, (161b)."""
    # And what the record has beyond the level, for pulses of no one shape: there each number of
    # their spectrum is measured, and paid for.
    record, two, null = recordings.clean.record, recordings.two, recordings.null
    prediction = predictor(record)
    residual = prediction.residual(record)
    shape = learn(steady(residual))
    shape = shape / np.linalg.norm(shape)
    sizes = np.abs(matched(residual, shape))
    count = rate_per_min / 60 * len(residual) / two.cut.rate_hz
    heights = sizes[places(sizes, max(int(np.rint(count)), 1))]
    power = np.sum(np.maximum(heights ** 2 - 1, 0.0)) / len(residual)
    cycles = two.cut.middles_hz / two.cut.rate_hz
    transfer = prediction.shaping(cycles)
    # the bands resolve the resonances better than the prediction does
    root = matrix_power(transfer @ transfer.conj().swapaxes(-1, -2), 0.5)
    back = np.linalg.inv(root)
    transfer = back @ matrix_power(root @ two.mean @ root, 0.5) @ back @ transfer
    turns = np.exp(-2j * np.pi * np.outer(cycles, np.arange(SHAPE)))
    pulse = np.einsum('bij,bj->bi', transfer, turns @ shape)
    level = np.exp(null.x[0])
    added = power * pulse[:, :, None] * pulse[:, None, :].conj() / level
    any_shape = positive(two.mean - null.prediction.mean) / level
    # a joint with play that a louder motion opens impacts as well
    pattern = ModalPattern.IMPULSES if recordings.level > LIMITS.other_level.value else None
    return (Form({}, (Number('relative_power', '1', 1.0, 0.0, 100.0),),
                 lambda n, x: (None, x[0] * added), pattern=pattern),
            Form({}, (), lambda n, x: (None, any_shape), measured=any_shape.size / 3,
                 pattern=pattern))
