"""A level, or natural frequencies, that change through a record, eq. (160) and (163)."""
import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.candidate import Form
from ssi_ros.gap.nominal.forms.structure import drifting_frequencies
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.tails import fisher, student

WINDOWS = 60            # of the shorter recording, in which the level is followed
LEAST_ROWS = 20         # of a window
FEW_GROUPS = 4          # below it no drift is distinguished from a change


def _log_power(residual, size, filled):
    """Return the log power of every window, its mean where more is filled than is recorded."""
    count = len(residual) // size
    found = np.log((residual[:size * count].reshape(count, -1) ** 2).mean(axis=1))
    own = filled[-len(residual):][:size * count].reshape(count, -1).mean(axis=1) < 0.5
    # what was filled has a level of its own
    return np.where(own, found, found[own].mean() if own.any() else 0.0), own


def modulation(residual_one, residual_two, rate_hz, filled=None):
    """Compare levels over windows, (160): p-value, variance ratio, depth, period [s], or None."""
    shorter = min(len(residual_one), len(residual_two))
    if shorter < LEAST_ROWS * WINDOWS:
        return None
    # windows of one length: shorter ones scatter more, whatever the level does
    size = shorter // WINDOWS
    filled = filled or [np.zeros(len(r), bool) for r in (residual_one, residual_two)]
    (before, one), (after, two) = (_log_power(r, size, f) for r, f in zip(
        (residual_one, residual_two), filled))
    if min(one.sum(), two.sum()) < WINDOWS / 4:
        return None
    usual, found = before[one].var(), after[two].var()
    ratio = found / usual
    # neighbouring windows repeat each other, so fewer degrees than windows
    p = float(fisher.sf(ratio, two.sum() // 2, one.sum() // 2))
    lines = np.abs(np.fft.rfft(after - after.mean()))
    best = 1 + int(np.argmax(lines[1:]))
    depth = float(min(np.sqrt(max(found - usual, 0.0) / 2), 0.99))
    if p > LIMITS.detected.value or depth < LIMITS.least_depth.value:
        return None
    return p, float(ratio), depth, len(after) * size / rate_hz / best


@detects('nonstationary_excitation', of='recordings')
def modulated_level(effect, recordings):
    """Detect a level that varies more than that of the reference; periods show it better."""
    found = None if recordings.enough_periods else modulation(
        *recordings.slew_normalised, recordings.pair.rate_hz, recordings.pair.filled)
    if found is None:
        return None
    p, ratio, depth, period_s = found
    return Detection(
        effect.name, {'depth': depth, 'period_s': period_s}, p,
        f'the level varies by {100 * depth:.2g} %, its variance is {ratio:.3g} times that of the '
        'reference', basis=lambda r: (Form({}, (), levels=r.group_levels),))


@detects('stiffness_drift', of='recordings')
def drift(effect, recordings):
    """Detect natural frequencies that move through a record."""
    # Without a trend the detection is weak: frequencies that drifted are tried all the same.
    test = recordings.score_test
    rows = [k for k, f in enumerate(test.labels)
            if f.pattern is ModalPattern.COMMON_FREQUENCY_RATIO]
    if not len(recordings.nominal.modes):
        return None
    # without such a form the effects considered leave no change that a drift competes with
    track = test.tracks[rows[0]] if rows else np.zeros(0)
    times_s = recordings.two.times_s
    slope, p = trend(track, times_s)
    odds = 0.0
    if len(track) >= FEW_GROUPS:
        most = LIMITS.certain_odds.value
        odds = float(np.clip(drift_odds(track, times_s), -most, most))
    weak = not p < LIMITS.detected.value
    text = '' if weak else ('the frequencies move through the record '
                            f'({slope:+.2g} sd of a group)')
    return Detection(effect.name, {}, p, text, weak=weak,
                     basis=lambda r: (drifting_frequencies(r.nominal, odds),))


def drift_odds(track, times_s):
    """Return the log odds of a drift of scores (g,) over a change that stays, (163)."""
    u = times_s / times_s[-1]
    rest = [np.sum((track - (track @ v) / (v @ v) * v) ** 2) for v in (np.ones(len(u)), u)]
    scatter = max(1.0, min(rest) / max(len(u) - 1, 1))
    return float((rest[0] - rest[1]) / (2 * scatter))


def trend(track, times_s):
    """Return slope over the record and p-value of a track of group scores, (163)."""
    if len(track) < 6:
        return 0.0, 1.0
    u = 2 * (times_s - times_s.mean()) / (times_s[-1] - times_s[0])
    slope = np.sum(u * track) / np.sum(u ** 2)
    rest = track - track.mean() - slope * u
    spread = np.sqrt(max(np.sum(rest ** 2) / (len(u) - 2), 1.0) / np.sum(u ** 2))
    return float(slope), float(2 * student.sf(abs(slope) / spread, len(u) - 2))
