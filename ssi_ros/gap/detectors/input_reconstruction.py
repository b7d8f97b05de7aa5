"""
The input that would explain a record, of unit variance where the model is right, eq. (106).

One input drives all channels, so h^H S^-1 Y is all that the record holds of it. Over its standard
deviation it is white where the model is right, and a disturbance of the input keeps its phase in
it: the whole record is searched coherently.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.arrays import runs
from ssi_ros.effects.base import lateness
from ssi_ros.gap.spectra.segmentation import spectra, whole_frame
from ssi_ros.gap.spectra.thresholds import LIMITS
from ssi_ros.hermitian import definite, inverse_root
from ssi_ros.updating.resonance_doubt import resonance_doubt
from ssi_ros.weighted_sums import total_of

EDGE_S = 1.0            # on which the taper rises and falls at the ends of the record
MARGIN_S = 6.0          # not used at both ends, where the taper disturbs the memory of filters
BESIDE_S = 2.0          # a filled gap that is not used where single samples count, on both sides


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """
    What a record holds of the first input.

    `residual` is what no input explains, as a disturbance of each channel: P Y over the root of
    the diagonal of P = S^-1 - S^-1 h h^H S^-1 / h^H S^-1 h.
    """

    rate_hz: float
    rows: int                   # samples of the record
    first: int                  # bin of the first value below
    values: np.ndarray          # (k,), whitened spectrum of the input, E|u|^2 = 1
    gain: np.ndarray            # (k,), what an input spectrum of 1 adds to it, sqrt(h^H S^-1 h)
    taper: np.ndarray           # (rows,), weights of the samples, of sum of squares 1
    residual: np.ndarray        # (k, l), see above
    residual_gain: np.ndarray   # (k, l), what a disturbance of 1 on a channel adds to it
    power: np.ndarray           # (k,), Y^H P Y, of l - 1 degrees of freedom
    white: np.ndarray           # (k, l), all channels whitened, C^H Y with C C^H = S^-1
    excited: float              # share of the power of `white` by excitation; the rest is noise
    missing: np.ndarray         # (rows,), rows that were filled: neither impulse nor calm
    spectrum: np.ndarray        # (k, l), Y
    inverse: np.ndarray         # (k, l, l), S^-1
    doubt: np.ndarray           # (k,), of the expected power, see `resonance_doubt`
    machine: np.ndarray         # (k,), `values` of an input that is not held over a sample,
    machine_gain: np.ndarray    # (k,), and its `gain`

    def tapered(self, values):
        """Return the tapered time series of such a spectrum, shape (rows,)."""
        full = np.zeros(self.rows // 2 + 1, complex)
        full[self.first:self.first + len(values)] = values
        return np.fft.irfft(full, self.rows)

    def series(self, weight=1.0, values=None):
        """Return the time series of weighted values, of unit variance, shape (rows,)."""
        weight = np.broadcast_to(weight, self.values.shape)
        values = self.values if values is None else values
        return self.tapered(values * weight) * (
            self.rows / np.sqrt(2 * np.sum(weight ** 2)) / (self.taper * np.sqrt(self.rows)))

    @property
    def inside(self):
        """Slice of the samples that the taper does not disturb."""
        edge = int(min(MARGIN_S * self.rate_hz, self.rows / 8))
        return slice(edge, self.rows - edge)

    @property
    def recorded(self):
        """Rows (n,) of these that were not filled, nor are beside what was."""
        # a candidate fills a gap such that the record has no power where it expects none
        kept, beside = np.zeros(self.rows, bool), round(BESIDE_S * self.rate_hz)
        kept[self.inside] = True
        for first, last in runs(self.missing):
            if last - first > LIMITS.gap_s.value * self.rate_hz:
                kept[max(0, first - beside):last + beside] = False
        return np.flatnonzero(kept)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """How well a record yet to be made would show an input; for `deflection`."""

    rate_hz: float
    rows: int                   # samples of the record
    channels: int
    frequencies_hz: np.ndarray  # (k,), of the bins
    gain: np.ndarray            # (k,), as of `Reconstruction`
    machine_gain: np.ndarray    # (k,), as well
    taper: np.ndarray           # (rows,), as well

    def of_sine(self, amplitude, low_hz, high_hz):
        """Return d' of a sine that passes a band, or stays at one frequency."""
        at = np.interp(np.linspace(low_hz, high_hz, 200), self.frequencies_hz,
                       self.machine_gain ** 2)
        return amplitude * np.sqrt(at.mean() / 2) * np.sum(self.taper)


def reconstruct(simulator, fitted, samples, settings, missing=None, filters=None):
    """
    Return the Reconstruction of the first input of a record by a fit that holds but for it.

    `samples` have no gaps; `missing`, (n,) of bool, says which rows were filled. Blocks of a
    record share their `filters`, by length. Channels that were sampled one beside the other are
    turned to the instants of the rows, the expected spectrum and the record alike.
    """
    filters, rows = {} if filters is None else filters, len(samples.values)
    if rows not in filters:
        # a clock that is wrong in the model as well: frequencies are those of the true time
        setup = simulator.setup(fitted.candidate, fitted.levels)
        frame = whole_frame(rows, setup.system.rate_hz, settings, EDGE_S)
        found = input_filter(simulator, setup, fitted.levels, frame)
        filters[rows] = frame, *found, resonance_doubt(simulator, setup, frame)
    frame, (row, gain), (steady, steady_gain), lower, inverse, excited, doubt = filters[rows]
    spectrum = spectra(samples, frame)[0]
    if simulator.late:
        spectrum = spectrum * lateness(simulator.late, frame.cycles).conj()
    values = np.einsum('kj,kj->k', row, spectrum) / gain
    rest = np.einsum('kij,kj->ki', inverse, spectrum) - (row.conj() * (values / gain)[:, None])
    own = np.sqrt(np.maximum(np.einsum('kii->ki', inverse).real
                             - np.abs(row) ** 2 / gain[:, None] ** 2, 1e-300))
    power = np.einsum('ki,ki->k', spectrum.conj(), rest).real
    white = np.einsum('kij,kj->ki', lower, spectrum)
    return Reconstruction(
        frame.rate_hz, frame.rows, frame.first, values, gain, frame.taper, rest / own, own, power,
        white, excited, np.zeros(frame.rows, bool) if missing is None else missing, spectrum,
        inverse, doubt, np.einsum('kj,kj->k', steady, spectrum) / steady_gain, steady_gain)


def sensitivity(simulator, setup, levels, rows, settings):
    """Return the Sensitivity of a record of so many rows, of a setup at levels."""
    rate_hz = simulator.spacecraft.rate_hz
    frame = whole_frame(rows, rate_hz, settings, EDGE_S)
    (_, gain), (_, steady_gain), *_ = input_filter(simulator, setup, levels, frame)
    return Sensitivity(rate_hz, rows, len(simulator.spacecraft.sensors), frame.frequencies_hz,
                       gain, steady_gain, frame.taper)


def input_filter(simulator, setup, levels, frame):
    """
    Return h^H S^-1 (k, l) and sqrt(h^H S^-1 h) (k,), L^-1 and S^-1 (k, l, l), of one segment.

    First of an input held over each sample, then of one that is not, eq. (106a); at the end comes
    the share of the whitened power that the excitation makes.
    """
    spectrum = simulator.on(frame).spectrum(setup)
    driven = total_of(level * share[0] for level, share in zip(levels, spectrum.shares[:-1]))
    noise = levels[-1] * spectrum.shares[-1][0]
    total = definite(total_of((driven, noise, spectrum.fixed[0])), noise)
    del spectrum            # of half an hour one part is 20 MB
    if simulator.late:
        late = lateness(simulator.late, frame.cycles).conj()
        total, driven = (s * late[:, :, None] * late[:, None, :].conj() for s in (total, driven))
    lower = inverse_root(total)
    inverse = lower.conj().swapaxes(-1, -2) @ lower
    excited = np.einsum('kij,kji->', inverse, driven).real / inverse[..., 0].size
    rows = []
    for rate_hz in (setup.system.rate_hz, None):
        h = setup.system.transfer(frame.frequencies_hz, rate_hz, slice(1))[:, :, 0]
        row = np.einsum('ki,kij->kj', h.conj(), inverse)
        rows.append((row, np.sqrt(np.einsum('kj,kj->k', row, h).real)))
    return *rows, lower, inverse, float(excited)
