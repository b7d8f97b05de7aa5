"""The clock of the recorder is fast or slow."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, in_deviations, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class ClockRate(Effect):
    """The true sample period is the nominal one times 1 + ppm 1e-6; stamps are nominal."""

    name = 'clock_rate'
    site = Site.TIMING
    size = 'ppm'
    reference = 'IEEE Std 1139 (frequency offset of an oscillator)'
    starts = {'ppm': (-500.0, 500.0)}
    patterns = (ModalPattern.COMMON_FREQUENCY_RATIO,)

    ppm: float = quantity(0.0, unit='1e-6', low=-3e5, high=3e5, doc='period over nominal, less 1')

    def apply(self, setup):
        """Return the setup sampled at the true rate."""
        rate_hz = setup.system.rate_hz / (1.0 + 1e-6 * self.ppm)
        return replace(setup, system=replace(setup.system, rate_hz=rate_hz))

    def deviations(self, spacecraft):
        """Return the size in declared deviations of the model's own error."""
        return in_deviations(1e-6 * self.ppm, spacecraft.uncertainty.frequency,
                             sum(a.modes for a in spacecraft.arrays))
