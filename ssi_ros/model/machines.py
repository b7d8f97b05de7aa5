"""
The torque of a machine, a sine or a chirp that no sampling holds, eq. (28a) of docs/theory.md.

A held input reaches the flexible motion half a sample late and the hub at once; that of a machine
does not, which the phases between channels show where it is strong.
"""
import numpy as np

from ssi_ros.model.excitation import columns, Filtered, layers, source

SMALL = 1e-6            # of an exponent, below which its quotient is taken for its limit


def is_machine(part):
    """Return whether a part of the excitation is not held over a sample."""
    return not getattr(source(part), 'held', True) and not any(
        isinstance(layer, Filtered) for layer in layers(part))


class Machine:
    """What such a part does in a StateSpace that is sampled: exact where its frequency stays."""

    def __init__(self, part, space, inputs, rate_hz):
        self.part, self.source, self.rate_hz = part, source(part), rate_hz
        (where,) = columns((self.source.input,), inputs)
        values, _, inverse = space.diagonal
        keep = values.imag >= 0                 # as in `StateSpace.discrete`
        self.values = values[keep, None]
        self.b = (inverse @ space.b[:, where])[keep, None]
        self.d = space.d[:, where]

    def at(self, first, count):
        """Return what it adds to the modal states (n, count) and to the channels (count, l)."""
        steps = first + np.arange(count)
        wave, omega = self.source.wave(steps, self.rate_hz)
        for layer in layers(self.part):
            wave = wave * layer.level(steps / self.rate_hz)
        added = wave * self._over_a_sample(omega) - wave.conj() * self._over_a_sample(-omega)
        return self.b * added / 2j, np.outer(wave.imag, self.d)

    @property
    def state(self):
        """Return the steady modal state at the first sample, (n,); what sweeps has just begun."""
        low, high = self.source.band_hz
        if low < high:
            return np.zeros(len(self.values), complex)
        (wave,), (omega,) = self.source.wave(np.zeros(1), self.rate_hz)
        ahead, back = (w / (1j * o - self.values) for w, o in (
            (wave, omega), (wave.conj(), -omega)))
        return (self.b * (ahead - back) / 2j)[:, 0]

    def _over_a_sample(self, omega):
        """Return the integral of exp(s (dt - t) + j omega t) over a sample, (n, count)."""
        away = (1j * omega - self.values) / self.rate_hz
        small = np.abs(away) < SMALL
        safe = np.where(small, 1.0, away)
        return np.exp(self.values / self.rate_hz) * np.where(
            small, 1.0, np.expm1(safe) / safe) / self.rate_hz
