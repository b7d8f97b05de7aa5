"""
What ratios between channels at the lines of a common drive exclude, eq. (186).

Under one signal that repeats itself the response at a line is Y_c(f) = H_c(f) U(f). Whatever
happens to the drive U changes all channels alike; a sensor changes its own channel alone. What is
left of the change between two recordings when both are taken out belongs to the structure.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.regimes.thresholds import LIMITS
from ssi_ros.tails import fisher

SMOOTH_TERMS = 4        # of a polynomial of frequency in each channel: gain, delay, low-pass
LEAST_LINES = 24        # beyond the terms of all channels
WALK = 4.0              # variance of two means over that of periods in either, of what walks


@dataclass(frozen=True)
class DriveEvidence:
    """What remains of the change of the channels at the lines of a common drive."""

    ratio: float = 0.0      # of its mean square over that of the scatter from period to period
    size: float = 0.0       # rms relative change
    p_value: float = 1.0    # chance of it in the least changed set of channels
    channels: int = 0       # left after the worst was taken out; 0 where nothing was compared

    @property
    def structural(self):
        """Whether neither the drive nor one sensor makes this change."""
        return (self.channels > 1 and self.p_value < LIMITS.certain.value
                and self.size > LIMITS.changed.value)

    @property
    def text(self):
        """Return what was found in words, empty where nothing was."""
        return (f'at the lines of the drive the channels changed against each other by '
                f'{100 * self.size:.2g} % rms, unevenly over frequency, whichever channel is left '
                'out: neither the drive nor one sensor does that') * self.structural


def drive_evidence(one, two):
    """Compare the lines of two Repeats of one signal, a `DriveEvidence`, eq. (186)."""
    found = [_lines(r) for r in (one, two)]
    w = 2 * np.pi * np.arange(len(found[0][0])) / one.mean.shape[0]
    first, second = found[0][0], found[1][0]
    noise = sum(s / np.maximum(np.square(np.abs(m)), 1e-300) for m, s in found)
    clear = (noise < 1 / LIMITS.clear_line.value).all(axis=1)
    clear[0] = False
    if clear.sum() < LEAST_LINES:
        return DriveEvidence()
    change = second[clear] / first[clear]
    count = min(len(r.periods) for r in (one, two))
    return _least(change, noise[clear], w[clear], count)


def _lines(repeats):
    """Return mean lines (f, l) of what repeats, and the variance of their means."""
    lines = np.fft.rfft(repeats.periods, axis=1)
    count = len(lines)
    mean = lines.mean(axis=0)
    return mean, np.square(np.abs(lines - mean)).sum(axis=0) / (count - 1) / count * WALK


def _least(change, noise, w, count):
    """Return the DriveEvidence of the channels that changed least, one being left out."""
    width = change.shape[1]
    sets = [list(range(width))] if width < 3 else [
        [c for c in range(width) if c != left] for left in range(width)]
    if width < 2:
        return DriveEvidence()
    return min((_uneven(change[:, s], noise[:, s], w, count) for s in sets),
               key=lambda e: -e.p_value if e.p_value > 0 else e.ratio)


def _uneven(change, noise, w, count):
    """Return the DriveEvidence of what is neither common nor smooth in some channels."""
    # against the mean of the channels; the delay of all is a phase that turns many times
    apart = np.log(change / change[:, :1])
    apart = apart - apart.mean(axis=1, keepdims=True)
    x = 2 * (w - w.min()) / np.ptp(w) - 1
    basis = np.polynomial.legendre.legvander(x, SMOOTH_TERMS - 1)
    rest = apart - basis @ np.linalg.lstsq(basis, apart, rcond=None)[0]
    size = np.square(np.abs(rest)).mean(axis=1)
    chance = noise.mean(axis=1) * (1 - 1 / change.shape[1])
    freedom = len(w) - SMOOTH_TERMS
    ratio = float(np.mean(size) / max(np.mean(chance), 1e-300))
    p = float(fisher.sf(ratio, 2, 2 * (count - 1)))
    return DriveEvidence(ratio, float(np.sqrt(np.mean(size))), p, change.shape[1] * (
        freedom > LEAST_LINES))
