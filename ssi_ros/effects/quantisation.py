"""The converter rounds."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_stage
from ssi_ros.model.sensors import Quantise
from ssi_ros.quantity import quantity


@effect
class Quantisation(Effect):
    """All channels are rounded to a step."""

    name = 'quantisation'
    site = Site.SENSOR
    size = 'step_m_s2'
    reference = 'Widrow and Kollar, Quantization Noise, 2008'
    starts = {'step_m_s2': (1e-3,)}
    spectral = False
    patterns = (ModalPattern.SAMPLE_VALUES,)

    step_m_s2: float = quantity(0.0, unit='m/s^2', low=0.0, high=1e3, doc='step')

    def in_samples(self, values):
        """Return the values, rounded."""
        return Quantise(self.step_m_s2).begin(None, None)(values)

    def apply(self, setup):
        """Return the setup with the rounding at the end of the chain."""
        return add_stage(setup, Quantise(self.step_m_s2))
