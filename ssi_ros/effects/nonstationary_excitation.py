"""The level of the excitation comes and goes."""
from dataclasses import replace
import math

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.model.excitation import Varying
from ssi_ros.quantity import quantity


@effect
class NonstationaryExcitation(Effect):
    """All excitation is multiplied by 1 + depth sin(2 pi t / period_s + phase_rad), (85)."""

    name = 'nonstationary_excitation'
    site = Site.EXCITATION
    size = 'depth'
    reference = 'amplitude modulation of a stationary process'
    starts = {'depth': (0.3,), 'period_s': (60.0, 120.0, 300.0)}
    spectral = False
    patterns = (ModalPattern.AMPLITUDE_MODULATION,)
    in_mean_spectrum = False

    depth: float = quantity(0.0, low=0.0, high=1.0, doc='relative modulation of the level')
    period_s: float = quantity(120.0, unit='s', low=1.0, high=1e5, doc='period of the level')
    phase_rad: float = quantity(0.0, unit='rad', low=-7.0, high=7.0,
                                doc='phase of the level at the first sample')

    def in_record(self, begin_s, span_s, duration_s):
        """Return the modulation with its phase at the first sample of the record."""
        phase = self.phase_rad - 2 * math.pi * begin_s / self.period_s
        return replace(self, phase_rad=math.remainder(phase, 2 * math.pi))

    def apply(self, setup):
        """Return the setup with all parts of the excitation varying together."""
        parts = tuple(Varying(p, self.depth, self.period_s, self.phase_rad)
                      for p in setup.system.excitation)
        return replace(setup, system=replace(setup.system, excitation=parts))
