"""Samples go missing."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_stage
from ssi_ros.effects.stages import Drop
from ssi_ros.quantity import quantity


@effect
class DroppedSamples(Effect):
    """Rows are missing at random and independently, and their stamps with them."""

    name = 'dropped_samples'
    site = Site.TIMING
    size = 'fraction'
    reference = 'Bernoulli losses, as of a best-effort topic'
    starts = {'fraction': (0.01,)}
    spectral = False
    patterns = (ModalPattern.SAMPLE_VALUES,)

    fraction: float = quantity(0.0, low=0.0, high=0.99, doc='share of the rows that is missing')

    def apply(self, setup):
        """Return the setup with the losses at the end of the chain."""
        return add_stage(setup, Drop(self.fraction))
