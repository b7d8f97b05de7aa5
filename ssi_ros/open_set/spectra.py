"""What the open-set test needs of a model beside a record, and the series of modes."""
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ssi_ros.model.excitation import source, White

REACH_HZ = 2.0          # around a natural frequency, of its series
DECAYS = 60.0           # of a mode within the record; fewer make its bins dependent


@dataclass(frozen=True, eq=False)
class RecordSpectra:
    """
    Spectra of a whole record of n rows and l channels, as one segment of k bins, and the model's.

    `poles`, `weights`, `outputs` and `inputs` are the sampled model in modal coordinates,
    z(k + 1) = poles z(k) + inputs u(k), y(k) = Re(outputs weights z(k)) + feed u(k), one of each
    pair of poles; `covariance` is that of u at the levels of the record.
    """

    rate_hz: float
    rows: int
    first: int                  # bin of the first value below
    recorded: np.ndarray        # (k, l), Y, tapered to unit sum of squares
    inverse: np.ndarray         # (k, l, l), S^-1 of the expected periodogram
    adjoint: np.ndarray         # (k, l), S^-1 Y
    poles: np.ndarray           # (p,)
    weights: np.ndarray         # (p,), 2 of a pair of poles, else 1
    outputs: np.ndarray         # (l, p)
    inputs: np.ndarray          # (p, m)
    feed: np.ndarray            # (l, m)
    covariance: np.ndarray      # (m, m)
    channels: tuple             # names

    @property
    def frequencies_hz(self):
        """Frequency of every bin, (k,) [Hz]."""
        return (self.first + np.arange(len(self.recorded))) * self.rate_hz / self.rows

    @property
    def duration_s(self):
        """Length of the record [s]."""
        return self.rows / self.rate_hz

    @cached_property
    def power(self):
        """Return the expected power of every channel, E |Y|^2, (k, l)."""
        return np.einsum('kii->ki', np.linalg.inv(self.inverse)).real

    def series(self, values):
        """Return the time series of spectra (k, ...), shape (n, ...), scaled by no taper."""
        full = np.zeros((self.rows // 2 + 1, *values.shape[1:]), complex)
        full[self.first:self.first + len(values)] = values
        return np.fft.irfft(full, self.rows, axis=0)

    def spectrum(self, series):
        """Return the spectrum of a time series (n,) in the bins, shape (k,)."""
        return np.fft.rfft(series)[self.first:self.first + len(self.recorded)]


@dataclass(frozen=True, eq=False)
class Mode:
    """
    One mode in a band of b bins: the adjoint of its equation, and its most probable state.

    A change delta of its pole changes the log likelihood by 2 Re sum_t delta(t) z(t) mu(t)*.
    """

    frequency_hz: float
    bins: slice                 # of the record that the band holds
    adjoint: np.ndarray         # (b,), mu
    state: np.ndarray           # (b,), z, given the whole record
    adjoint_power: np.ndarray   # (b,), E |mu|^2
    state_power: np.ndarray     # (b,), E |z|^2
    cross: np.ndarray           # (b,), E z mu*
    pole: complex
    displaced: complex          # phase that turns z into an acceleration
    shape: np.ndarray           # (l,), outputs of z
    decays: float               # of its amplitude in the record


def record_spectra(system, levels, reconstruction, channels):
    """
    Return the RecordSpectra of a record beside a System at levels of its white excitations.

    `reconstruction` holds `rate_hz`, `rows`, `first`, `spectrum` and `inverse` of the record.
    """
    sampled = system.state_space.discrete(system.rate_hz)
    white = [source(p) for p in system.excitation if isinstance(source(p), White)]
    covariance = sum(level * p.covariance(system.rate_hz, system.inputs)
                     for level, p in zip(levels, white))
    r = reconstruction
    return RecordSpectra(
        r.rate_hz, r.rows, r.first, r.spectrum, r.inverse,
        np.einsum('kij,kj->ki', r.inverse, r.spectrum), sampled.poles, sampled.weight, sampled.c,
        sampled.b, sampled.d, covariance, channels)


def modes_of(record):
    """Return the Modes of a RecordSpectra in its bins that decay in it, by rising frequency."""
    found, f = [], record.frequencies_hz
    z = np.exp(2j * np.pi * f / record.rate_hz)
    pair = record.weights > 1
    poles = np.concatenate([record.poles, record.poles[pair].conj()])
    outputs = np.hstack([record.outputs, record.outputs[:, pair].conj()])
    inputs = np.vstack([record.inputs, record.inputs[pair].conj()])
    for r in np.argsort(np.abs(np.angle(record.poles))):
        at_hz = abs(np.angle(record.poles[r])) * record.rate_hz / (2 * np.pi)
        decays = -np.log(max(np.abs(record.poles[r]), 1e-300)) * record.rows
        if not (pair[r] and f[0] < at_hz < f[-1] and decays > DECAYS):
            continue
        low, high = np.searchsorted(f, [at_hz - REACH_HZ, at_hz + REACH_HZ])
        band = slice(int(low), int(high))
        around = z[band, None]
        gain = (1 / (around - record.poles[r]))[:, 0]
        # E y u_r^*: what the channels hold of the force on this mode
        held = record.covariance @ record.inputs[r].conj()
        seen = (1 / (around - poles) * (inputs @ held)) @ outputs.T + record.feed @ held
        shape = record.outputs[:, r]
        inverse, v = record.inverse[band], record.adjoint[band]
        of_shape = inverse @ shape
        found.append(Mode(
            at_hz, band, gain.conj() * (v @ shape.conj()),
            gain * np.einsum('ki,ki->k', seen.conj(), v),
            np.abs(gain) ** 2 * (of_shape @ shape.conj()).real,
            np.abs(gain) ** 2 * np.einsum('ki,kij,kj->k', seen.conj(), inverse, seen).real,
            gain ** 2 * np.einsum('ki,ki->k', seen.conj(), of_shape), record.poles[r],
            shape[np.argmax(np.abs(shape))], shape, decays))
    return tuple(found)
