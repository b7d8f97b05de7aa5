"""
Lines and sweeps in what does not repeat of a recording, each compared with the reference.

Between the lines of a periodic excitation is only noise, so a line or a sweep of another source
stands out there however weak it is beside the excitation, eq. (173) and (174).
"""
import numpy as np

from ssi_ros.events.lines import AROUND, flanks, OWN_BINS
from ssi_ros.events.track import cells, HALF_LAPPED, straight
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.scipy_later import maximum_filter1d
from ssi_ros.tails import fisher, gamma

TREND_PERIODS = 6       # that have a residual beside a mean and a trend
BANDS = (8.0, 80.0)     # times the rows, the squared rows of a window: sweeps wide and narrow
LEAST_WINDOWS = 8       # side by side
LEAST_WAY = 5           # bins that a sweep passes: below it is a line


def _fine(repeats):
    """Return the spectrum of what does not repeat, (f, l), density of power [unit^2 / Hz]."""
    # Without a taper: over whole periods what repeats is in the bins of its lines and in no
    # others. What grows evenly from period to period, as in a structure that warms up, is taken
    # out as well.
    periods = repeats.periods
    count, rows, width = periods.shape
    along = np.arange(count) - (count - 1) / 2
    terms = 2 if count >= TREND_PERIODS else 1
    basis = np.stack([np.ones(count), along])[:terms]
    basis /= np.linalg.norm(basis, axis=1, keepdims=True)
    flat = periods.reshape(count, -1)
    rest = (flat - basis.T @ (basis @ flat)) * np.sqrt(count / (count - terms))
    return np.fft.rfft(rest.reshape(-1, width), axis=0) * np.sqrt(
        2 / (count * rows * repeats.rate_hz))


def _stands_out(power):
    """Return whether a bin is far above those next to its own on either side, shape (f,)."""
    # The skirt of a line of the excitation, or of a mode, rises towards it.
    top = np.zeros_like(power)
    for away in range(2, OWN_BINS + 2):
        for side in (-away, away):
            top = np.maximum(top, np.roll(power, side, axis=0))
    return (power > LIMITS.steep.value * top).any(axis=1)


def _skirts(repeats, size):
    """Return what a slow change of level or structure puts around every line, up to a factor."""
    # Whatever the change, it surrounds the lines of the excitation and falls off from them.
    count = len(repeats.periods)
    power = np.square(np.abs(np.fft.rfft(repeats.mean, axis=0)))
    comb = np.zeros((size, power.shape[1]))
    comb[::count] = power[:len(comb[::count])]
    away = np.arange(-2 * count, 2 * count + 1)
    found = np.apply_along_axis(np.convolve, 0, comb, 1.0 / (1.0 + away ** 2.0), 'same')
    return found + 1e-12 * found.max(axis=0)


def line(one, two, level):
    """Return p-value, frequency [Hz], amplitudes (l,) of a line only in the record, (173)."""
    observed = _fine(two)
    power, before = np.square(np.abs(observed)), np.square(np.abs(_fine(one)))
    between = (np.arange(len(power)) % len(two.periods) > 0)[:, None].astype(float)
    top = max(level, 1.0) * maximum_filter1d(before, 2 * AROUND + 1, axis=0)
    at = np.rint(np.linspace(0, len(top) - 1, len(power))).astype(int)
    levelled = power / _skirts(two, len(power))
    ratios = [power / flanks(power, between), levelled / flanks(levelled, between),
              power / np.maximum(top[at], 1e-300)]
    # channels may move as one: two degrees of freedom, whatever their number
    found = np.min([r.mean(axis=1) for r in ratios], axis=0) * between[:, 0]
    # of a sine of amplitude A the density is A^2 T / 2
    amplitude = np.sqrt(2 * power / two.seconds)
    rms = np.sqrt(np.square(two.periods).mean(axis=(0, 1)))
    least = np.sqrt(2) * LIMITS.negligible_noise.value * rms
    clear = (amplitude > least).any(axis=1) & _stands_out(power)
    clear[:AROUND] = clear[-AROUND:] = False
    best = int(np.argmax(found * clear))
    # lines of the excitation are not compared with it
    around = between[best + np.r_[-AROUND:-OWN_BINS, OWN_BINS + 1:AROUND + 1]].sum()
    p = float(fisher.sf(found[best] * clear[best], 2, 2 * around)) * len(found)
    if not p < LIMITS.detected.value:
        return None
    frequency = float(_peak(power[best - 1:best + 2].sum(axis=1), best) / two.seconds)
    return p, frequency, observed[best] * np.sqrt(2 / two.seconds)


def _peak(power, best):
    """Return where between bins a line is, from the amplitudes of three bins without a taper."""
    low, middle, high = np.sqrt(power)
    return best + (high / (middle + high) if high > low else -low / (middle + low))


def _best_track(powers, periods):
    """
    Return the straight track of most power: standard deviations, log p-value, first and last bin.

    The sum over a track scatters as a gamma variable of the moments of all cells. The loudest
    third of the recording, or of each of its periods, is left out in the end, whichever leaves
    less: a sweep is there all the time, what dies away is not, though it begin anew in every
    period.
    """
    windows, bins = powers.shape
    track = straight(powers, LEAST_WAY, bins - 1)
    if track is None:
        return 0.0, 0.0, 0.0, 0.0
    along = powers[np.arange(windows), track.path]
    share = (np.arange(windows) + 0.5) / windows
    quieter = min((_without_loudest(along, s) for s in (share, share * periods % 1.0)),
                  key=np.mean)
    mean, var = powers.mean(), powers.var()
    count = len(quieter) / (1 + 2 * HALF_LAPPED)
    log_p = gamma.logsf(count * quieter.mean(), count * mean ** 2 / var, scale=var / mean)
    deviations = (quieter.mean() - mean) * np.sqrt(count / var)
    return float(deviations), float(log_p + 2 * np.log(bins)), track.start, track.end


def _without_loudest(along, share):
    """Return the powers of a track but those of the loudest third, by shares from 0 to 1."""
    third = np.floor(3 * share)
    return along[third != max(range(3), key=lambda k: along[third == k].mean())]


def sweep(one, two):
    """Return p-value, start and end [Hz] of a line that moves in what does not repeat, (174)."""
    best = None
    first, rest = one.rest, two.rest
    for squared in BANDS:
        size = int(np.sqrt(squared * min(len(first), len(rest)))) // 2 * 2
        if min(len(first), len(rest)) < LEAST_WINDOWS * size:
            continue
        usual = _best_track(cells(first, size), len(one.periods))[0]
        sd, log_p, start, end = _best_track(cells(rest, size), len(two.periods))
        log_p += np.log(len(BANDS))
        if log_p < np.log(LIMITS.detected.value) and sd > LIMITS.stronger.value * usual and (
                best is None or log_p < best[0]):
            # the whole periods end before the recording does
            end = start + (end - start) * two.recorded / len(two.periods)
            best = log_p, start * two.rate_hz / size, end * two.rate_hz / size
    if best is None:
        return None
    log_p, start_hz, end_hz = best
    return float(np.exp(log_p)), float(start_hz), float(end_hz)
