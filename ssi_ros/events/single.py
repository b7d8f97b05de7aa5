"""
A single event in a vibration that repeats itself, by each period against both of its neighbours.

    d(t) = y(t) - [y(t - P) + y(t + P)] / 2,   u(t) = |mean of d over P / 4| in robust deviations

A steady vibration is not in d, and what is fast and without a mean, as rattle, is hardly in its
mean over a quarter of a period; a shock has a mean. What happened at t is in d at t - P and t + P
as well, half as large.
"""
import numpy as np

from ssi_ros.tails import student

AGAIN = 0.9             # autocorrelation after one period
NEARLY = 0.98           # of the best period: a shorter one that is as good is the one
LEAST_PERIODS = 12      # that a recording holds
SAME = 0.05             # relative difference of the periods of two recordings of one drive
WINDOWS = 4             # of a period, over which a deviation is averaged
NEAR = 3.0              # periods around an event that are its own
EDGE = 2                # periods beside the first and the last, where a drive starts or stops
LARGE = 10.0            # robust deviations of an event at least
STRONGER = 2.0          # over the largest event of the reference
TAIL = 4                # degrees of freedom of deviations: rattle is not Gaussian
TO_DEVIATION = 1.4826   # a standard deviation over the median of magnitudes, where all is Gaussian


def single_event(reference, record, alike):
    """
    Find an event in a periodic record that the reference has none like.

    Parameters
    ----------
    reference, record : ndarray, shape (n, l) and (m, l)
        Two recordings at one rate, without gaps.
    alike : callable
        Returns the autocorrelation (n,) of values (n, l).

    Returns
    -------
    tuple or None
        Row of the event in the record, its size [robust standard deviations] and p-value; None
        where neither repeats itself or the record has no such event.

    """
    periods = [carrier_rows(alike(v)) for v in (reference, record)]
    if None in periods or abs(periods[1] / periods[0] - 1) > SAME:
        return None
    usual = _largest(reference, periods[0])[0]
    size, row, others = _largest(record, periods[1])
    if size < max(LARGE, STRONGER * usual, STRONGER * others):
        return None
    tests = WINDOWS * len(record) / periods[1]
    return row, size, float(min(1.0, 2 * tests * student.sf(size, TAIL)))


def carrier_rows(alike):
    """Return the period in rows by an autocorrelation, None where there is none."""
    alike = alike[:len(alike) // LEAST_PERIODS]
    below = np.flatnonzero(alike < 0)
    if not len(below):
        return None
    later = alike[below[0]:]
    if later.max() < AGAIN:
        return None
    first = below[0] + int(np.argmax(later > NEARLY * later.max()))
    # up to the top of that maximum
    return first + int(np.argmax(alike[first:first + max(first // 8, 1)]))


def _largest(values, period):
    """Return size and row of the largest event, and the size of the next that is not its own."""
    apart = values[period:-period] - (values[2 * period:] + values[:-2 * period]) / 2
    width = max(period // WINDOWS, 1)
    sums = np.cumsum(np.vstack([np.zeros(values.shape[1]), apart]), axis=0)
    means = np.abs(sums[width:] - sums[:-width]) / width
    sizes = np.sqrt(np.mean(np.square(
        means / (TO_DEVIATION * np.median(means, axis=0))), axis=1))
    sizes[:EDGE * period] = sizes[len(sizes) - EDGE * period:] = 0.0
    at = int(np.argmax(sizes))
    away = np.abs(np.arange(len(sizes)) - at) > NEAR * period
    return float(sizes[at]), at + period + width // 2, float(sizes[away].max(initial=0.0))
