"""Effects at other sizes."""
import numpy as np
import pytest

from ssi_ros.effects import applicable, effect_class
from ssi_ros.effects.sizes import at_size, brackets, until_worse
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import load_spacecraft

CRAFT = load_spacecraft()
SIDE = Simulator(CRAFT, make_frame(6000, 100.0, DiagnosisSettings()), 60.0)


def started(name):
    """Return the effect at the first of its starting values and its first place."""
    cls = effect_class(name)
    words = {f.name: {'array': 'E1', 'channel': 'e1_a', 'source': 'e1_b', 'force': 'all'}[f.name]
             for f in cls.words()}
    return cls(**words, **{k: v[0] for k, v in cls.starts_on(CRAFT, words).items()})


@pytest.mark.parametrize('name', [n for n in applicable(CRAFT) if effect_class(n).spectral
                                  and started(n).first_order < 1.0])
def test_a_share_of_first_order_changes_a_spectrum_in_proportion(name):
    """Five times as much changes five times as much, to 0.1 %; a line that moves would not."""
    effect, base = started(name), SIDE.expected(Candidate()).at_nominal
    weight = 1 / np.trace(base, axis1=2, axis2=3).real[..., None, None]
    once, five = (weight * (SIDE.expected(Candidate((at_size(
        effect, k * effect.first_order),))).at_nominal - base) / k for k in (1, 5))
    assert np.linalg.norm(once - five) < 1e-3 * np.linalg.norm(once)


@pytest.mark.parametrize('name', ['gyroscopic_coupling', 'attitude_controller', 'hinge_friction',
                                  'hinge_compliance', 'sensor_drift'])
def test_what_has_no_small_size_is_taken_as_it_starts(name):
    """A nutation, starts at several frequencies, laws, what is infinite or of another power."""
    assert started(name).first_order == 1.0


def test_sizes_that_only_explain_less_end_a_search():
    """Of each sign for itself: the best of the gains below one is far, of those above it near."""
    every = brackets(started('sensor_gain'), 0.01)
    liked = {e: -abs(np.log(e.scale / (0.3 if e.scale < 1 else 1.02))) for e in every}
    tried = [e.scale for _, e in until_worse(every, liked.get)]
    assert min(tried) == min(e.scale for e in every)
    assert 1.02 < max(tried) < 1.1 < max(e.scale for e in every)
