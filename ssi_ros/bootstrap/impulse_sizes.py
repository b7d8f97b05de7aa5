"""How many impulses an input has and how large they are, of which most hide in noise, (108a)."""
import numpy as np

from ssi_ros.bootstrap.synthetic_likelihood import posterior
from ssi_ros.gap.detectors.thresholds import LIMITS

MOST_PEAKS = 1500
RESPONSE = 3000         # samples after which the response to an impulse is over
COUNTS, HEIGHTS = 60, 50    # points of the grid
LOWEST = 0.15           # height over that of the highest peak
LOUDEST = 0.999         # share of the power of the input at any frequency that impulses make
ONE_SIGN = 0.8          # share of the peaks, from which all impulses have it
OFF = 0.1, 0.02         # of number and height, by which such series err: validation.gap_impulses
SEED = 9_200_000


def rms_of(unit, count):
    """Return the standard deviation of so many samples, without what peaks add."""
    return float(np.sqrt(np.sum(np.minimum(unit ** 2, 9.0)) / count / 0.97))


def peaks(unit, response):
    """Return places and signed heights of peaks, the responses to larger ones taken out."""
    unit, places, heights = unit.copy(), [], []
    half = min(len(unit), RESPONSE)
    both = np.concatenate([response[half - 1:0:-1], response[:half]])
    while len(heights) < MOST_PEAKS:
        at = int(np.argmax(np.abs(unit)))
        height = unit[at]
        if abs(height) < LIMITS.least_peak.value:
            break
        places.append(at)
        heights.append(height)
        low, high = max(0, at - half + 1), min(len(unit), at + half)
        unit[low:high] -= height * both[low - at + half - 1:high - at + half - 1]
    return np.array(places, int), np.array(heights)


def impulse_sizes(one, unit, spectrum):
    """
    Return mean and standard deviation of how many impulses there are, and of their height.

    Of a Reconstruction, its matched-filter series `unit` (n,) and the spectrum of its noise,
    (rows / 2 + 1,). Series like it are simulated: impulses have raised the level that it is
    measured by, those below its peaks are not counted, and those that ring together are one.
    None where impulses as high as the peaks would have more power than the whole record.
    """
    generator, there = np.random.default_rng(SEED), ~one.missing[one.inside]
    count, shape = np.count_nonzero(there), spectrum * one.rows / (2 * spectrum.sum())
    response = np.fft.irfft(shape, one.rows)
    rms, heights = _peaks_of(unit, response, count)
    high = np.abs(heights).max() / 2
    goal = _statistics(unit, rms, heights, count, high)
    share = np.mean(heights > 0.0)
    signs = [-1.0, 1.0] if 1 - ONE_SIGN < share < ONE_SIGN else [1.0]
    top = np.log(2.2 * high)
    grid = np.stack(np.meshgrid(
        np.linspace(np.log(0.5), np.log(count / 10), COUNTS),
        np.linspace(top + np.log(LOWEST), top, HEIGHTS), indexing='ij'), -1).reshape(-1, 2)

    def possible(points):
        return np.exp(points @ (1.0, 2.0)) / count * shape.max() < LOUDEST
    grid = grid[possible(grid)]
    if not len(grid):
        return None

    def simulate(point):
        number, height = np.exp(point)
        noise = np.fft.rfft(generator.standard_normal(one.rows))
        places = generator.integers(one.rows, size=round(number * one.rows / count))
        pulses = np.bincount(places, generator.choice(signs, len(places)), one.rows)
        # the levels follow the power of the impulses that there are
        rest = np.maximum(1 - len(places) / one.rows * height ** 2 * shape, 0.0)
        series = np.fft.irfft(noise * np.sqrt(shape * rest)
                              + height * shape * np.fft.rfft(pulses), one.rows)
        series = np.where(there, series[one.inside], 0.0)
        return _statistics(series, *_peaks_of(series, response, count), count, high)

    points, chances = posterior(simulate, goal, grid, possible, generator)
    values = np.exp(points)
    mean = chances @ values
    # a Poisson number
    variance = chances @ (values - mean) ** 2 + (mean[0], 0.0) + (OFF * mean) ** 2
    return tuple(zip(mean, np.sqrt(variance)))


def _peaks_of(unit, response, count):
    """Return the standard deviation of a series and the signed heights of its peaks."""
    rms = rms_of(unit, count)
    return rms, rms * peaks(unit / rms, response)[1]


def _statistics(unit, rms, heights, count, high):
    """Return what is known of a series and its peaks, (7,); `high` is half of the highest."""
    power, heights = np.sum(unit ** 2) / count, np.abs(heights)
    above, highest = heights / rms - LIMITS.least_peak.value, heights[heights > high]
    return np.log([
        len(above) + 1.0, (above.sum() + 0.5) / (len(above) + 1), above @ above + 1.0,
        np.sum(unit ** 4) / count / power ** 2, rms / np.sqrt(power), len(highest) + 1.0,
        (highest.sum() + high) / (len(highest) + 1)])
