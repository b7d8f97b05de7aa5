"""A random force at a point of a model, where none was known."""
from ssi_ros.effects.base import Effect, effect, Site
from ssi_ros.effects.points import strongest_rms, with_force
from ssi_ros.quantity import quantity


@effect
class RandomForce(Effect):
    """A white force at one point, of `share` times the rms of the strongest that is known."""

    name = 'random_force'
    site = Site.EXCITATION
    size = 'share'
    reference = 'Bendat and Piersol, Random Data, 2010, section 7 (multiple-input systems)'
    starts = {'share': (0.3,)}
    power = 2.0
    needs = ('points',)

    freedom: str = quantity('', doc='point, see `ssi_ros model FILE`')
    share: float = quantity(0.0, low=0.0, high=1e3,
                            doc='its rms over that of the strongest white input')

    def apply(self, setup):
        """Return the setup with the force."""
        if self.is_null:
            return setup
        return with_force(setup, self.freedom, self.share * strongest_rms(setup.system))
