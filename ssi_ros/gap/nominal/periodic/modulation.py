"""
A level that is modulated slowly under a signal that repeats itself, eq. (175) and (176).

Each window is compared with the same part of the mean period, in several bands: the level of an
excitation is that of all its lines, a structure that drifts changes each in its own way.
"""
import numpy as np

from ssi_ros.gap.nominal.periodic.repeats import delay_between, turned
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.tails import fisher

WINDOWS = 8             # of a period
BANDS = 6               # of equally many bins that hold the signal
LEAST_BANDS = 3         # that must hold it
LOUD = 300.0            # times what no common level explains: such bins hold the signal
MOST = 50.0             # cycles in a recording: faster ones are no slow change of level
LONGEST = 0.5           # cycles in a recording at least
FEWEST = 4              # windows of a cycle at least
STEP, FINER = 0.25, 25  # of the number of cycles that are tried, and points around the best
LEAST_RESIDUAL = 0.1    # mean square of a sine that its mean over the periods must leave


def gains_of(repeats, usual):
    """Return the levels of windows, by band (w, q), over a usual period (n, l), less 1, (175)."""
    rms = np.sqrt(np.square(repeats.periods).mean(axis=(0, 1)))
    count, rows, width = repeats.periods.shape
    size = rows // WINDOWS
    taper = np.sin(np.pi * (np.arange(size) + 0.5) / size)[:, None]

    def spectra(values):
        parts = (values / rms)[..., :size * WINDOWS, :].reshape(-1, size, width)
        return np.fft.rfft(parts * taper, axis=1)
    there, usual = spectra(repeats.periods), np.tile(spectra(usual), (count, 1, 1))
    products = (usual.conj() * there).real.sum(axis=2)
    powers = np.square(np.abs(usual)).sum(axis=2)
    common = products.sum(axis=1) / powers.sum(axis=1)
    rest = np.square(np.abs(there - common[:, None, None] * usual)).sum(axis=(0, 2))
    loud = np.flatnonzero(powers.sum(axis=0) > LOUD * rest)
    bands = [b for b in np.array_split(loud, BANDS) if len(b)]
    gains = [products[:, b].sum(axis=1) / powers[:, b].sum(axis=1) - 1.0 for b in bands]
    return np.reshape(gains, (len(gains), len(there))).T


def _waves(cycles, count, folded):
    """Return cosine and sine over the windows, (w, 2), less those of a mean period if folded."""
    angle = 2 * np.pi * cycles * (np.arange(count * WINDOWS) + 0.5) / (count * WINDOWS)
    waves = np.column_stack([np.cos(angle), np.sin(angle)])
    if folded:
        return waves - np.tile(waves.reshape(count, WINDOWS, 2).mean(axis=0), (count, 1))
    return waves - waves.mean(axis=0)


def common_sine(gains, folded=True):
    """Return cosine and sine (2,), cycles and p-value of the sine in all gains (w, q), (176)."""
    windows, bands = gains.shape
    count = windows // WINDOWS
    if bands < LEAST_BANDS:
        return np.zeros(2), 0.0, 1.0
    gains = gains - gains.mean(axis=0)

    def fitted(cycles):
        waves = _waves(cycles, count, folded)
        if np.square(waves).mean() < LEAST_RESIDUAL:
            return 0.0, np.zeros((2, bands))
        sizes = np.linalg.lstsq(waves, gains, rcond=None)[0]
        return float(np.square(waves @ sizes.mean(axis=1)).sum()), sizes
    tried = np.arange(LONGEST, min(windows / FEWEST, MOST), STEP)
    coarse = tried[np.argmax([fitted(c)[0] for c in tried])]
    near = coarse + STEP * np.linspace(-1, 1, FINER)
    cycles = near[np.argmax([fitted(c)[0] for c in near])]
    sizes = fitted(cycles)[1]
    mean = sizes.mean(axis=1)
    if not mean.any():
        return np.zeros(2), float(cycles), 1.0
    scatter = np.square(sizes - mean[:, None]).sum() / (2 * (bands - 1))
    ratio = bands * (mean @ mean) / 2 / max(scatter, 1e-300)
    p = float(fisher.sf(ratio, 2, 2 * (bands - 1))) * len(tried)
    return mean, float(cycles), min(p, 1.0)


def modulation(one, two):
    """Compare how the level is modulated: p-value, cosine and sine (2,), period [s], or None."""
    # A modulation in step with the signal is in the mean period itself; where the reference had
    # the same signal its mean period has not.
    usual = np.hypot(*common_sine(gains_of(one, one.mean))[0])
    sizes, cycles, p = common_sine(gains_of(two, two.mean))
    delay, alike = delay_between(one, two)
    least = LIMITS.least_depth.value
    if alike > LIMITS.same_signal.value and (
            p > LIMITS.detected.value or np.hypot(*sizes) < least):
        sizes, cycles, p = common_sine(gains_of(two, turned(one, delay)), folded=False)
    depth = float(np.hypot(*sizes))
    if p > LIMITS.detected.value or depth < max(least, LIMITS.deeper.value * usual):
        return None
    return p, sizes, two.seconds / cycles
