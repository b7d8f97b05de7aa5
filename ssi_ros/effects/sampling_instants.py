"""When the channels are read: delays, low-passes, jitter, channels beside each other."""
import numpy as np

from ssi_ros.effects.base import lateness


class SamplingInstants:
    """
    Applies what a Setup says of the sampling instants to spectra in a frame, eq. (89).

    What mixes channels does so before they are read, each at its own instant: the channels are
    `late` after the sensor chain. The noise of jitter is of those instants, of one scan, which may
    begin in another row: `at_once` before it.
    """

    def __init__(self, setup, frame, jitter_noise):
        turn = 2 * np.pi * setup.system.rate_hz / frame.rows
        omega = turn * np.arange(frame.first, frame.last)
        self.phase = self.loss = self.turn = None
        self.scan = 1.0
        if setup.late:
            scan = jitter_noise.scan if jitter_noise else setup.late
            self.turn, self.scan = (t[:, :, None] * t[:, None, :].conj() for t in (
                lateness(late, frame.cycles) for late in (setup.late, scan)))
        if any(setup.delays_s) or setup.corners_hz:
            read = setup.reading(omega / (2 * np.pi))
            self.phase = read[:, :, None] * read[:, None, :].conj()
        if setup.jitter_rms_s:
            self.loss = np.exp(-(omega * setup.jitter_rms_s) ** 2)[:, None, None]
            self.share = 2.0 / frame.rows
        self.jitter_noise, self.noise = jitter_noise, 0.0

    def __call__(self, spectrum, part):
        if self.phase is not None:
            spectrum = spectrum * self.phase
        if self.loss is not None:
            # power that jitter takes comes back white, from the same instants on all channels
            white = self.share * np.sum(((1 - self.loss) * self.scan * spectrum).real, axis=-3,
                                        keepdims=True)
            spectrum = spectrum * self.loss
            if self.jitter_noise is None:
                return spectrum + self.at_once(white)
            # taken from the motion of the record: no level scales it
            self.noise = self.noise + self.jitter_noise.of(part, white)
        return spectrum

    def late(self, spectrum):
        """Return a spectrum of channels that are read at their own instants."""
        return spectrum if self.turn is None else spectrum * self.turn

    def at_once(self, spectrum):
        """Return a spectrum that `late` makes what is given."""
        return spectrum * np.conj(self.scan)
