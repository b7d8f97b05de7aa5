"""
A line in all channels jointly, or in one given the others, beside an earlier recording, eq. (162).

    Q = x^H M^-1 x,   M = sum of x_k x_k^H over K bins around

Of what the past does not predict, x (l,) at one bin of a whole recording, the spectrum is smooth:
(K - l + 1) Q / l is F with 2 l and 2 (K - l + 1) degrees of freedom. A line in one channel alone
has a known direction a, and |a^H M^-1 x|^2 / (a^H M^-1 a) over 1 + Q less itself is F with 2.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.events.lines import AROUND
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.tails import fisher, gamma

REACH, OWN = 40, 3      # bins around a line on each side, and those of them that are its own
PER_CHANNEL = 3         # of the bins around, at least
GRIDS = 2               # whole bins and half ones: between two bins a line is in neither
BLOCK = 2048            # bins at once
STRONGER = 2.0          # than anything near it in the reference
SEEN = 0.05             # p-value below which the reference stands out there as well


@dataclass(frozen=True, eq=False)
class Standing:
    """How far bins of a recording stand out of those around them, all channels and each."""

    hz: np.ndarray          # (f,), bins and half bins
    sizes: np.ndarray       # (f, 1 + l), power over what is around; all channels and each
    chances: np.ndarray     # (f, 1 + l), of so much in this bin


def standing(errors, way, rate_hz, ends_hz):
    """Return the Standing of white errors (n, l) of a Predictor, between two frequencies."""
    rows, width = errors.shape
    turn = np.exp(-1j * np.pi * np.arange(rows) / rows)[:, None]
    first, last = (int(np.ceil(e * rows / rate_hz)) for e in ends_hz)
    found = []
    for half in range(GRIDS):
        # without a taper whole bins apart are independent: what is white does not leak
        spectrum = (np.fft.fft(errors * turn, axis=0)[:rows // 2] if half else
                    np.fft.rfft(errors, axis=0))[first:last]
        hz = (first + half / 2 + np.arange(len(spectrum))) * rate_hz / rows
        found += [(hz[b], *_of_block(spectrum, way, hz / rate_hz, b))
                  for b in np.split(np.arange(len(hz)), np.arange(BLOCK, len(hz), BLOCK))]
    hz, sizes, chances = (np.concatenate(c) for c in zip(*found))
    order = np.argsort(hz)
    return Standing(hz[order], sizes[order], chances[order])


def _of_block(spectrum, way, cycles, block):
    """Return sizes and chances, (b, 1 + l), of bins of a spectrum (f, l)."""
    width = spectrum.shape[1]
    reach = max(REACH, PER_CHANNEL * width)
    low, high = max(block[0] - reach, 0), min(block[-1] + 1 + reach, len(spectrum))
    part = spectrum[low:high]
    outer = part[:, :, None] * part[:, None, :].conj()
    sums = np.concatenate([np.zeros((1, width, width)), np.cumsum(outer, axis=0)])
    at = block - low

    def inside(away):
        ends = np.clip(at - away, 0, len(part)), np.clip(at + away + 1, 0, len(part))
        return sums[ends[1]] - sums[ends[0]], ends[1] - ends[0]
    (around, count), (own, few) = inside(reach), inside(OWN)
    freedom = np.maximum(count - few - width + 1, 1)
    inverse = np.linalg.inv(around - own)
    x = part[at]
    turned = np.einsum('fij,fj->fi', inverse, x)
    joint = np.einsum('fi,fi->f', x.conj(), turned).real
    # columns of what turns channels into errors
    directions = np.linalg.inv(way.shaping(cycles[block]) / way.scale[:, None])
    along = np.abs(np.einsum('fij,fi->fj', directions.conj(), turned)) ** 2
    along /= np.einsum('fij,fik,fkj->fj', directions.conj(), inverse, directions).real
    alone = along / (1 + np.maximum(joint[:, None] - along, 0.0))
    sizes = freedom[:, None] * np.column_stack([joint, alone])
    chances = np.column_stack([
        fisher.sf(sizes[:, 0] / width, 2 * width, 2 * freedom),
        *(fisher.sf(s, 2, 2 * freedom) for s in sizes[:, 1:].T)])
    return sizes, chances


def joint_line(recordings, found):
    """
    Return the line that another search found, or a clearer one of all channels jointly.

    Parameters
    ----------
    recordings : Recordings
        Of motion that does not repeat itself.
    found : tuple or None
        p-value, frequency [Hz], amplitudes (l,) [m/s^2] of a line, and whether it is too small to
        be a gap by itself.

    Returns
    -------
    tuple or None
        The same; of a line in one channel alone the amplitudes of the others are 0.

    """
    if recordings.repeats is not None or found is not None and not found[3]:
        return found
    rate_hz, ends_hz = recordings.pair.rate_hz, recordings.full_cut.ends_hz
    (before, now), errors = recordings.predictors, recordings.prediction_errors
    here = standing(errors[1], now[1], rate_hz, ends_hz)
    # two searches; what two grids find of one line is counted twice, which is too often
    chances = 2 * here.chances.size * here.chances.min(axis=1)
    tried = np.flatnonzero(chances < LIMITS.detected.value)
    if not len(tried):
        return found
    # a prediction fits what is narrow in its own recording, as it cannot in another
    both = errors[0], now[1].residual(before[0])
    usual = [standing(e, way[1], rate_hz, ends_hz) for e, way in zip(both, (before, now))]
    longer = max(1.0, len(errors[1]) / len(errors[0]))
    for k in tried:
        chances[k] = max(chances[k], *(_by_reference(here, k, u, longer) for u in usual))
    best = tried[np.argmin(chances[tried])]
    if not chances[best] < LIMITS.detected.value:
        return found
    vector = _amplitudes(here, best, errors[1], now[1], rate_hz)
    share = np.square(np.abs(vector) / now[1].scale) / 2
    faint = bool(share.max() < LIMITS.negligible_noise.value ** 2)
    if faint and found is not None:
        return found
    return float(chances[best]), float(here.hz[best]), vector, faint


def _by_reference(here, at, there, longer):
    """Return the chance of a line at a bin beside what stands out near it in the reference."""
    which = int(np.argmin(here.chances[at]))
    size = here.sizes[at, which]
    step = here.hz[1] - here.hz[0]
    near = np.abs(there.hz - here.hz[at]) <= GRIDS * AROUND * max(step, there.hz[1] - there.hz[0])
    sizes, chances = there.sizes[near, which], there.chances[near]
    # a line that is too weak to be seen in a short reference
    if not len(sizes) or size < STRONGER * longer * sizes.max():
        return 1.0
    # two recordings of one narrow mode differ as two exponential variables do
    seen = chances.size * chances.min() < SEEN
    return 1 / (1 + size / sizes.max()) if seen else 0.0


def _amplitudes(here, at, errors, way, rate_hz):
    """Return the complex amplitudes (l,) of a line, of those channels that need one."""
    rows, width = errors.shape
    cycles = here.hz[at] / rate_hz
    x = 2 / rows * np.exp(-2j * np.pi * cycles * np.arange(rows)) @ errors
    shaping = way.shaping(np.array([cycles]))[0]
    which = int(np.argmin(here.chances[at])) - 1
    if which < 0:
        return shaping @ x
    # errors are white enough: the channel by what it alone makes of them
    a = np.linalg.inv(shaping)[:, which]
    size = (a.conj() @ x) / (a.conj() @ a).real
    rest = np.sum(np.abs(x - size * a) ** 2) * rows / 4
    if gamma.sf(rest, width - 1) < SEEN:
        return shaping @ x
    return size * np.eye(width)[which]
