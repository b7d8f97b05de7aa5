"""The nominal that a reference recording gives: its spectrum, its noise floor, its modes."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.gap.nominal.periodic.stationarity import steadiness
from ssi_ros.gap.spectra.band_averages import Cut
from ssi_ros.identify import Identification, identify
from ssi_ros.identify.shapes import mac
from ssi_ros.records import Samples
from ssi_ros.scipy_later import linear_sum_assignment

HOPS = 24               # blocks of the recording, whose scatter gives the spreads of its modes
LEAST_DAMPING = 5e-4    # below it a pole is a line
RESOLVED = 0.3          # half-power half-width in bins, below which a shift cannot be followed
MOST_MODES = 30         # strongest first
REACH = 12.0            # half-widths around a mode in which its change counts
NEAR_BINS = 6           # at least so many bins
DISTINCT = 5.0          # condition number of shapes that can be distinguished
FARTHEST = 0.3          # logarithm of frequency ratio that weighs like shapes of MAC 0
NOISE_QUANTILE = 0.02   # of what the other channels do not explain, over the bands


@dataclass(frozen=True, eq=False)
class Modes:
    """
    Modes with the filters that pick them out of the channels: (m,), shapes and duals (l, m).

    The largest component of a shape is 1. The duals are psi of eq. (147): psi^H phi = 1, and 0 for
    the neighbours as far as channels allow. Of `separable` modes, no more than channels, they are
    0 for all others, and a change counts at all frequencies.
    """

    frequencies_hz: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray
    duals: np.ndarray
    separable: bool = False

    def __len__(self):
        return len(self.frequencies_hz)

    def reach_hz(self, i, cut):
        """Return the distance from mode i up to which its change counts [Hz]."""
        return np.inf if self.separable else reach_hz(
            self.frequencies_hz[i], self.damping_ratios[i], cut)


@dataclass(frozen=True, eq=False)
class Nominal:
    """The spectrum of a reference recording, its noise and its modes."""

    cut: Cut                # bands
    spectrum: np.ndarray    # (b, l, l), mean spectrum
    floor: np.ndarray       # (l,), bound of the noise of the channels
    modes: Modes            # whose change the bands resolve
    trust: np.ndarray       # (b,), share of its independent spectra that counts, eq. (143)
    channels: tuple         # names
    identified: tuple       # all modes that were found in it, of which `modes` are some
    levels: np.ndarray = None       # (k, b l l), whitened, what levels change; None if one does
    law: float = 1.0        # variance of scores, over that of chance, by errors of levels, (150c)

    def with_spectrum(self, spectrum):
        """Return the same nominal around another estimate of its spectrum."""
        return replace(self, spectrum=spectrum)

    def trusted(self, share):
        """Return the same nominal, with no band of more weight than its share, (b,)."""
        return replace(self, trust=np.minimum(self.trust, share))


def make_nominal(values, channels, cut, spectrum, spectra=None):
    """Return the nominal of a reference (n, l) and its `spectra`, its modes identified."""
    found = identified(values, channels, cut.rate_hz)
    trust = _trust(found, cut)
    if spectra is not None:
        trust = np.minimum(trust, steadiness(spectra))
    return Nominal(cut, spectrum, noise_floor(spectrum), _modes(found, len(channels), cut), trust,
                   tuple(channels), found)


def noise_floor(spectrum):
    """Return a bound of the noise of each channel (l,): what the others do not explain of it."""
    own = 1.0 / np.einsum('bii->bi', np.linalg.inv(spectrum)).real
    return np.quantile(own, NOISE_QUANTILE, axis=0)


def identified(values, channels, rate_hz):
    """Return the modes of a whole recording, by rising frequency; none where it is too short."""
    hop_s = int(len(values) / HOPS) / rate_hz
    try:
        window = identify(Samples(values, rate_hz, tuple(channels)),
                          Identification(window_s=HOPS * hop_s, hop_s=hop_s))[-1]
    except ValueError:              # less than the identification asks for
        return ()
    return tuple(sorted(window.modes, key=lambda m: m.frequency_hz))


def moves(modes, there):
    """Return the log frequency ratios of modes and those there, (m,); 0 where not found again."""
    found = np.zeros(len(modes))
    if len(modes) and len(there):
        alike = mac(modes.shapes.T, there.shapes.T)
        for i, (_, ratio) in found_again(modes, there, alike).items():
            found[i] = ratio
    return found


def found_again(modes, there, alike):
    """Return what mode of another recording each mode is, and the log of the frequency ratio."""
    # Modes belong together by their shapes first, `alike` of shape (m, k) from 0 to 1: a mode that
    # moved past another keeps its shape.
    ratios = np.log(there.frequencies_hz[None] / modes.frequencies_hz[:, None])
    # one that is not found again is as far as one may be, and takes no other's place
    away = np.minimum(1 - alike + np.abs(ratios) / FARTHEST, 1.0)
    return {i: (j, ratios[i, j]) for i, j in zip(*linear_sum_assignment(away)) if away[i, j] < 1.0}


def modes_of(nominal, found):
    """Return modes of another recording, chosen of those identified as the reference's were."""
    return _modes(found, len(nominal.channels), nominal.cut)


def _trust(found, cut):
    trust = np.ones(cut.bands)
    length_s = cut.rows / cut.rate_hz
    bins = cut.freedom(1.0)
    for m in found:
        xi = max(m.damping_ratio, LEAST_DAMPING)
        width = xi * m.frequency_hz * length_s          # half-power half-width in bins
        alike = np.exp(-4 * np.pi * width)              # power of one segment and the next
        share = (1 - alike) / (1 + alike) * min(1.0, (1 + np.pi * width) / bins)
        near = np.abs(cut.middles_hz - m.frequency_hz) < reach_hz(m.frequency_hz, xi, cut)
        trust[near] = np.minimum(trust[near], share)
    return trust


def _modes(found, width, cut):
    low, high = cut.ends_hz
    found = [m for m in found
             if m.damping_ratio > LEAST_DAMPING and low < m.frequency_hz < high
             and m.damping_ratio * m.frequency_hz > RESOLVED * cut.resolution_hz]
    found = sorted(found, key=lambda m: m.frequency_std_hz / m.frequency_hz)[:MOST_MODES]
    found.sort(key=lambda m: m.frequency_hz)
    if not found:
        nothing = np.zeros(0)
        return Modes(nothing, nothing, *(np.zeros((width, 0)),) * 2)
    frequencies, dampings = np.array([(m.frequency_hz, m.damping_ratio) for m in found]).T
    shapes = np.array([m.shape for m in found]).T
    separable = bool(len(found) <= width and np.linalg.cond(shapes) < DISTINCT)
    duals = np.linalg.pinv(shapes).conj().T if separable else _duals(
        frequencies, dampings, shapes, cut)
    return Modes(frequencies, dampings, shapes, duals, separable)


def reach_hz(frequency_hz, damping_ratio, cut):
    """Return the distance from a mode up to which its change counts [Hz]."""
    return max(REACH * damping_ratio * frequency_hz, NEAR_BINS * cut.resolution_hz)


def around(cut, frequency_hz, reach, points):
    """Return bands near a frequency (c,), frequencies in each (c, points) [Hz], a window (c,)."""
    away = cut.middles_hz - frequency_hz
    bands = np.flatnonzero(np.abs(away) <= 3 * reach)
    half = (cut.band_bins / 2 + 1) * cut.resolution_hz
    f = cut.middles_hz[bands][:, None] + np.linspace(-half, half, points)
    # far away other modes dominate
    return bands, f, 1 / (1 + (away[bands] / reach) ** 8)


def _duals(frequencies, dampings, shapes, cut):
    duals = np.zeros_like(shapes)
    for i, f in enumerate(frequencies):
        away = np.abs(frequencies - f)
        order = np.argsort(away)
        near = [k for k in order if away[k] < reach_hz(f, dampings[i], cut)][:len(shapes)]
        # shapes that hardly differ cannot be distinguished: drop the farther ones
        while len(near) > 1 and np.linalg.cond(shapes[:, near]) > DISTINCT:
            near.pop()
        duals[:, i] = np.linalg.pinv(shapes[:, near])[near.index(i)].conj()
    return duals
