"""
Weight of bands whose power changes from period to period by far more than noise does, eq. (178a).

Under a periodic drive the response of a linear structure is the same in every period but for
noise, whose power in many lines hardly scatters. The distortion of a loose joint does: its power
rises and falls in all lines at once, so that many bands tell of it no more than one does.
"""
import numpy as np

from ssi_ros.scipy_later import median_filter, uniform_filter1d
from ssi_ros.tails import chi2, fisher

WIDE = 15               # bands over which the levels of a period are averaged
LEAST_FREEDOM = 2       # degrees of freedom of a variance that has a mean error
RARE = 0.01             # chance with which noise scatters as much
OFTEN = 0.05            # and two recordings of one kind differ as much
ROUND_OFF = 1e-300


def common_scatter(repeats, dither, cut):
    """
    Return the variance over the periods of relative power, and that of noise, (b,) each.

    `dither` is the power density of the noise that was added to each channel, (l,), `cut` says
    which the bands are; levels are averaged over WIDE bands and over the channels.
    """
    count, rows, _ = repeats.periods.shape
    lines = np.fft.rfft(repeats.periods, axis=1) * np.sqrt(2 / (rows * repeats.rate_hz))
    f = np.fft.rfftfreq(rows, 1 / repeats.rate_hz)
    ends = np.append(cut.middles_hz - cut.width_hz / 2, cut.middles_hz[-1] + cut.width_hz / 2)
    at = np.searchsorted(ends, f) - 1
    inside = (at >= 0) & (at < cut.bands)

    def banded(values):
        out = np.zeros((cut.bands, *values.shape[1:]))
        np.add.at(out, at[inside], values[inside])
        return out
    power = np.square(np.abs(lines)) + dither
    usual = np.maximum(banded(power.mean(axis=0)), ROUND_OFF)
    levels = np.array([banded(p) for p in power]) / usual
    # of a sum of lines a X + noise: 2 a^2 s + s^2, with s the power of the noise in each
    rest = np.square(np.abs(lines - lines.mean(axis=0))).sum(axis=0) / (count - 1) + dither
    noise = banded(2 * power.mean(axis=0) * rest - np.square(rest)) / np.square(usual)
    size = min(WIDE, cut.bands)

    def wide(values):
        return uniform_filter1d(values.mean(axis=-1), size, axis=-1)
    return wide(levels).var(axis=0, ddof=1), wide(noise) / size / power.shape[2]


def steady_share(repeats, dither, cut, freedom):
    """
    Return the share (b,) of the independent spectra of a band that a common level leaves.

    `repeats` are those of both recordings, `freedom` the independent spectra behind a band of
    either. A level that walks sets two recordings four times as far apart, in variance, as the
    periods of one are.
    """
    known = np.array([len(r.periods) - 1 for r in repeats])
    total = known.sum()
    if min(known) < 1 or total < LEAST_FREEDOM:
        return np.ones(cut.bands)
    found = [common_scatter(r, dither, cut) for r in repeats]
    # what the record has far more of than the reference is a difference and no noise of either
    most = fisher.isf(OFTEN, known[-1], known[0]) * np.maximum(*found[0])
    observed, noise = (sum(k * np.minimum(v, most) for k, v in zip(known, values)) / total
                       for values in zip(*found))
    # what noise alone reaches in one band of a hundred is no variation
    scatter = np.maximum(observed - chi2.isf(RARE, total) / total * noise, 0.0)
    # neighbours vary together: one that does so little in a few periods does by chance
    scatter = np.maximum(scatter, median_filter(scatter, min(2 * WIDE + 1, cut.bands)))
    count = total / len(known) + 1
    apart = 4 * count / (count + 1) * total / max(total - 2, 1) * scatter
    order = np.sort(apart)
    # the bands that go with each: all that scatter as much, and others by what they scatter
    below = np.concatenate([[0.0], np.cumsum(order)])
    rank = np.searchsorted(order, apart)
    together = len(order) - rank + below[rank] / np.maximum(apart, ROUND_OFF)
    number = 1 / sum(1 / n for n in freedom)
    return 1.0 / (1.0 + number * together * apart)
