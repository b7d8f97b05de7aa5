"""Effective number of spectra of a signal that repeats itself and slowly varies, (178)."""
import numpy as np

from ssi_ros.scipy_later import uniform_filter1d

SMOOTH = 15             # bands over which the coherence of periods is averaged
LEAST = 1e-3            # coherence of periods that is none
APART = 2.0             # lengths of a reference, by which a record may be later


def coherence(periods, cut, rate_hz):
    """Return the coherence of periods (p, n, l) that are 1 ... p - 1 apart, (p - 1, b)."""
    y = np.fft.rfft(periods, axis=1)
    f = np.fft.rfftfreq(periods.shape[1], 1 / rate_hz)
    ends = np.append(cut.middles_hz - cut.width_hz / 2, cut.middles_hz[-1] + cut.width_hz / 2)
    at = np.searchsorted(ends, f) - 1
    inside = (at >= 0) & (at < cut.bands)

    def banded(values):
        out = np.zeros((cut.bands, values.shape[1]), values.dtype)
        np.add.at(out, at[inside], values[inside])
        smooth = [uniform_filter1d(part, min(SMOOTH, cut.bands), axis=0)
                  for part in (out.real, out.imag)]
        return smooth[0] + 1j * smooth[1]
    found = []
    for lag in range(1, len(y)):
        one, two = y[:-lag], y[lag:]
        cross = banded((one.conj() * two).sum(axis=0))
        powers = [banded(np.square(np.abs(v)).sum(axis=0)).real for v in (one, two)]
        found.append(np.mean(np.abs(cross) / np.sqrt(np.maximum(np.prod(powers, axis=0), 1e-300)),
                             axis=1))
    return np.array(found)


def independent_share(repeats, cut, same):
    """Return the share (b,) of the independent spectra of a band that periods leave, (178)."""
    # Coherent periods are one spectrum and not many. That makes no difference as long as both
    # recordings have the same signal; what varies slowly, as the noise of a loose joint does, is
    # coherent within each and not in both.
    count = len(repeats.periods)
    alike = np.maximum(coherence(repeats.periods, cut, repeats.rate_hz), LEAST)
    lags = np.arange(1, count)
    root = np.sqrt(count - lags)            # so many pairs of periods determine it
    terms = np.column_stack([np.ones(len(lags)), lags]) * root[:, None]
    apart, walk = np.linalg.lstsq(terms, -np.log(alike) * root[:, None], rcond=None)[0]
    # two periods do not distinguish a walk from noise; the noise of a joint has a walk
    walk = np.maximum(walk, 0.0) if count > 2 else -np.log(alike[0])
    # coherence neither rises with time nor is above 1 at once
    apart = np.maximum(np.average(-np.log(alike) - walk * lags[:, None], axis=0,
                                  weights=count - lags), 0.0)

    def power(lag):
        return np.exp(-2 * (apart + walk * lag))
    within = 1 + 2 * sum((1 - k / count) * power(k) for k in lags)
    between = sum((1 - abs(k) / count) * power(APART * count + k) for k in range(1 - count, count))
    return 1.0 / np.maximum(within - between * same, 1.0)
