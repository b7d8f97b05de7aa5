"""Whether a recording repeats itself, as under a shaker that plays one signal over and over."""
import numpy as np

FORGOTTEN = 0.5         # of the autocorrelation: below it a recording has forgotten itself
AGAIN = 0.8             # and above it, later, it is the same once more
NEARLY = 0.95           # of the best: a shorter period that is as good is the one
LEAST_PERIODS = 2       # that a recording must hold
LEAST_ROWS = 256        # of a period that is worth to be cut by


def autocorrelation(values):
    """Return the autocorrelation of a recording (n, l) at every lag (n,), mean of channels."""
    rows = len(values)
    size = 1 << int(np.ceil(np.log2(2 * rows)))
    unit = (values - values.mean(axis=0)) / values.std(axis=0)
    power = (np.abs(np.fft.rfft(unit, size, axis=0)) ** 2).mean(axis=1)
    return np.fft.irfft(power)[:rows] / (rows - np.arange(rows))


def period_of(values):
    """Return the period of a recording (n, l) in rows, None where it does not repeat itself."""
    # A resonance repeats itself as well, but forgets steadily: what counts is an autocorrelation
    # that comes back after it was gone.
    alike = autocorrelation(values)[:len(values) // LEAST_PERIODS + 1]
    # the envelope: an oscillation is not forgotten where it passes zero
    block = LEAST_ROWS // 4
    blocks = len(alike) // block
    envelope = np.abs(alike[:blocks * block]).reshape(blocks, block).max(axis=1)
    gone = np.flatnonzero(envelope < FORGOTTEN)
    if not len(gone):
        return None
    first = gone[0] * block
    period = first + int(np.argmax(alike[first:]))
    if alike[period] < AGAIN:
        return None
    # several periods repeat as well as one does
    for count in range(period // LEAST_ROWS, 1, -1):
        part = round(period / count)
        if part > first and alike[part - 1:part + 2].max() > NEARLY * alike[period]:
            return part
    return period if period >= LEAST_ROWS else None
