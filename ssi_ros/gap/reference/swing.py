"""
A level that swings slowly under a signal that repeats itself, eq. (175) and (176).

Each window is compared with the same part of the mean period, in several bands: the level of an
excitation is that of all its lines, a structure that drifts moves each in its own way.
"""
import numpy as np
from scipy.stats import f as fisher

from ssi_ros.gap.reference.repeats import delay_between, SAME_SIGNAL, turned
from ssi_ros.gap.reference.signs import NEVER, Sign

SEEN = 1e-3             # p-value below which a sign is told
WINDOWS = 8             # of a period
BANDS = 6               # of equally many bins that hold the signal
LEAST_BANDS = 3         # that must hold it
LOUD = 300.0            # times what no common level explains: such bins hold the signal
MOST = 50.0             # swings in a recording: faster ones are no slow change of level
LEAST_DEPTH = 0.02      # that is told
DEEPER = 2.0            # times what the reference shows
LONGEST = 0.5           # swings in a recording at least
FEWEST = 4              # windows of a swing at least
STEP, FINER = 0.25, 25  # of the number of swings that are tried, and points around the best
LEAST_LEFT = 0.1        # mean square of a swing that its mean over the periods must leave


def gains_of(repeats, usual):
    """
    Return the level of each window over that of the same part of a period, less 1, (175).

    Parameters
    ----------
    repeats : Repeats
        The recording.
    usual : ndarray, shape (n, l)
        Period that its own are compared with.

    Returns
    -------
    ndarray, shape (w, q)
        By window and band; the bands have equally many bins, on a mode or off it.

    """
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
    left = np.square(np.abs(there - common[:, None, None] * usual)).sum(axis=(0, 2))
    loud = np.flatnonzero(powers.sum(axis=0) > LOUD * left)
    bands = [b for b in np.array_split(loud, BANDS) if len(b)]
    gains = [products[:, b].sum(axis=1) / powers[:, b].sum(axis=1) - 1.0 for b in bands]
    return np.reshape(gains, (len(gains), len(there))).T


def _waves(cycles, count, folded):
    """
    Return cosine and sine over the windows, shape (w, 2), less what a mean period has of them.

    `folded` tells whether the mean is over these very periods; else it has nothing of them.
    """
    angle = 2 * np.pi * cycles * (np.arange(count * WINDOWS) + 0.5) / (count * WINDOWS)
    waves = np.column_stack([np.cos(angle), np.sin(angle)])
    if folded:
        return waves - np.tile(waves.reshape(count, WINDOWS, 2).mean(axis=0), (count, 1))
    return waves - waves.mean(axis=0)


def best_swing(gains, folded=True):
    """
    Return the sine that all bands have in common, (176).

    Parameters
    ----------
    gains : ndarray, shape (w, q)
        As of `gains_of`.
    folded : bool
        Whether they are over the mean of the same periods.

    Returns
    -------
    sizes : ndarray, shape (2,)
        Of cosine and sine from the start of the windows.
    cycles : float
        How often it swings over the windows.
    p_value : float
        Chance that the bands agree so well, as each goes its own way.

    """
    windows, bands = gains.shape
    count = windows // WINDOWS
    if bands < LEAST_BANDS:
        return np.zeros(2), 0.0, 1.0
    gains = gains - gains.mean(axis=0)

    def fitted(cycles):
        waves = _waves(cycles, count, folded)
        if np.square(waves).mean() < LEAST_LEFT:
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


def swing(one, two):
    """
    Compare how the level swings.

    A swing in step with the signal is in the mean period itself; where the reference had the same
    signal its mean period has not.

    Parameters
    ----------
    one, two : Repeats
        Reference and record.

    Returns
    -------
    Sign or None
        Of `nonstationary_excitation`.

    """
    usual = np.hypot(*best_swing(gains_of(one, one.mean))[0])
    sizes, cycles, p = best_swing(gains_of(two, two.mean))
    delay, alike = delay_between(one, two)
    if (p > SEEN or np.hypot(*sizes) < LEAST_DEPTH) and alike > SAME_SIGNAL:
        sizes, cycles, p = best_swing(gains_of(two, turned(one, delay)), folded=False)
    depth = float(np.hypot(*sizes))
    if p > SEEN or depth < max(LEAST_DEPTH, DEEPER * usual):
        return None
    period_s = two.seconds / cycles
    return Sign('nonstationary_excitation', {'sizes': tuple(sizes)}, {
        'depth': (min(depth, 0.99), '1'), 'period_s': (period_s, 's')}, max(p, 10 * NEVER),
        f'the level of all lines swings by {100 * depth:.2g} % in {period_s:.3g} s')
