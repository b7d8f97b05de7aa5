"""What holds for every effect of the library, whoever wrote it."""
import inspect
import re

import numpy as np
import pytest

from ssi_ros.effects import (
    applicable, effect_class, inject, parse_effect, simulate_setup, Site, with_laws)
from ssi_ros.effects.registry import detectors, detects, showing
import ssi_ros.gap.detectors         # noqa: F401 (its files register themselves)
from ssi_ros.model import assemble, load_spacecraft, simulate
from ssi_ros.quantity import quantities

SECONDS = 8.0
# of a spacecraft
NAMES = [cls.name for cls in with_laws(map(effect_class, applicable(None)))]
FIXED = {     # the names that labels and verdicts share
    Site.EXCITATION: 'excitation_colour harmonic_disturbance impulsive_events '
                     'nonstationary_excitation wheel_speed_sweep',
    Site.STRUCTURE: 'added_mass array_asymmetry attitude_controller cubic_stiffness damping_scale '
                    'fuel_slosh gyroscopic_coupling hinge_compliance hinge_freeplay '
                    'hinge_friction hub_inertia stiffness_drift stiffness_scale',
    Site.SENSOR: 'channel_delay quantisation saturation sensor_bandwidth sensor_crosstalk '
                 'sensor_drift sensor_gain sensor_misplacement sensor_noise',
    Site.TIMING: 'clock_rate dropped_samples timestamp_jitter'}


def sized(name):
    """Return the effect at the first of its starting values, which is not null."""
    cls = effect_class(name)
    return cls(**{key: values[0] for key, values in cls.starts.items()})


@pytest.fixture(scope='module')
def spacecraft():
    return load_spacecraft()


@pytest.fixture(scope='module')
def nominal(spacecraft):
    return simulate(assemble(spacecraft), SECONDS, 3).values


def test_the_library_has_the_fixed_names():
    """All names are there, at their sites."""
    for site, names in FIXED.items():
        assert {n for n in NAMES if effect_class(n).site is site} >= set(names.split())


@pytest.mark.parametrize('name', NAMES)
def test_default_is_identity(name, spacecraft, nominal):
    """An effect at its defaults gives the nominal record, bit for bit."""
    effect = effect_class(name)()
    assert effect.is_null
    samples = simulate_setup(inject(spacecraft, [effect], SECONDS), 3)
    np.testing.assert_array_equal(samples.values, nominal)


@pytest.mark.parametrize('name', NAMES)
def test_sized_effect_changes_the_record_and_stays_finite(name, spacecraft, nominal):
    """Not null: other samples, same grid, and numbers of the same order as the nominal ones."""
    effect = sized(name)
    assert not effect.is_null
    samples = simulate_setup(inject(spacecraft, [effect], SECONDS), 3)
    assert samples.values.shape == nominal.shape
    assert samples.rate_hz == spacecraft.rate_hz
    assert not np.array_equal(samples.values, nominal)
    # 3: no start value is so large that the record leaves the order of the nominal one
    assert np.nanstd(samples.values) < 3 * nominal.std()
    assert np.isnan(samples.values).any() == (name == 'dropped_samples')


@pytest.mark.parametrize('name', NAMES)
def test_pure_and_repeatable(name, spacecraft):
    """The same effect twice gives the same record; the input is not changed."""
    before = load_spacecraft()
    effect = sized(name)
    first, second = (simulate_setup(inject(spacecraft, [effect], 2.0), 5) for _ in range(2))
    np.testing.assert_array_equal(first.values, second.values)
    assert spacecraft == before


@pytest.mark.parametrize('name', NAMES)
def test_text_round_trip(name):
    """What the command line writes it reads."""
    assert parse_effect(sized(name).text()) == sized(name)


@pytest.mark.parametrize('name', NAMES)
def test_declared_fully(name):
    """Every effect says where its physics is from, and every quantity what it is."""
    cls = effect_class(name)
    assert cls.reference and inspect.getdoc(cls)
    assert cls.size in {f.name for f in quantities(cls)}
    assert set(cls.starts) <= {f.name for f in cls.numbers()}
    assert all(f.metadata['doc'] for f in quantities(cls))


@pytest.mark.parametrize('name', NAMES)
def test_a_model_can_show_it(name):
    """Beside a model an effect is in the expected spectrum, or has a detector."""
    has_detector = any(name in detectors(of) for of in ('samples', 'input', 'spectrum'))
    assert effect_class(name).spectral or has_detector


@pytest.mark.parametrize('name', NAMES)
def test_a_recording_can_show_it(name):
    """Where there is no geometry an effect declares a pattern, and is found by it."""
    cls = effect_class(name)
    patterns = effect_class(cls.law_of or name).patterns
    assert patterns and all((cls.law_of or name) in showing(p) for p in patterns)


def test_a_second_detector_of_one_kind_is_refused():
    """The message names both, and what to do."""
    def other(effect, samples):
        return None
    with pytest.raises(ValueError, match='detect_clipping in .* and .*other in .*take one away'):
        detects('saturation', of='samples')(other)
    with pytest.raises(ValueError, match='must be one of samples, input, spectrum'):
        detects('saturation', of='torque')


@pytest.mark.parametrize('text, axis', [('harmonic_disturbance:torque_n_m=1', 'torque_x'), (
    'harmonic_disturbance:torque_n_m=1,drives=torque_z', 'torque_z')])
def test_a_disturbance_drives_the_input_that_it_names(text, axis, spacecraft):
    """The first input by default, which the text of the effect leaves out."""
    effect = parse_effect(text)
    assert inject(spacecraft, [effect]).system.excitation[-1].input == axis
    assert ('drives' in effect.text()) == (axis != 'torque_x')
    assert parse_effect(effect.text()) == effect


def test_an_input_that_is_not_there_is_refused(spacecraft):
    """The near names are listed."""
    with pytest.raises(ValueError, match='did you mean torque_'):
        inject(spacecraft, [parse_effect('impulsive_events:impulse_n_m_s=1,drives=torque_q')])


@pytest.mark.parametrize('name', NAMES)
def test_out_of_range_is_refused(name):
    """The range of the size is kept, and the message names it."""
    cls = effect_class(name)
    low = next(f for f in quantities(cls) if f.name == cls.size).metadata['low']
    with pytest.raises(ValueError, match=cls.size):
        cls(**{cls.size: low - 1.0})


@pytest.mark.parametrize('text, said', [
    ('sensor_gian:scale=1', 'did you mean sensor_gain'),
    ('sensor_gain:scal=1', 'did you mean scale'),
    ('sensor_gain:scale=x', 'must be a number'),
    ('sensor_gain:scale', 'has no value')])
def test_bad_text(text, said):
    """A wrong word is answered with the near ones."""
    with pytest.raises(ValueError, match=re.escape(said)):
        parse_effect(text)


@pytest.mark.parametrize('text', [
    'sensor_gain:channel=e9,scale=2', 'array_asymmetry:array=E3,scale=0.9',
    'hinge_compliance:array=E3,stiffness_n_m_rad=1000', 'channel_delay:channel=x,delay_s=0.01',
    'sensor_misplacement:channel=e1_a,along_m=5', 'sensor_misplacement:channel=q,along_m=-1'])
def test_a_place_that_is_not_there(text, spacecraft):
    """Injection refuses an unknown channel or array, and a point off the array."""
    with pytest.raises(ValueError):
        inject(spacecraft, [parse_effect(text)])


def test_one_hinge_an_array(spacecraft):
    """Two effects that set the same hinge are refused by name; on two arrays they are fine."""
    two = ['cubic_stiffness:array=E2,k3_n_m_rad3=1e12', 'hinge_compliance:array=E2,'
           'stiffness_n_m_rad=1e6']
    with pytest.raises(ValueError, match='cubic_stiffness and hinge_compliance both set'):
        inject(spacecraft, [parse_effect(t) for t in two])
    inject(spacecraft, [parse_effect(two[0]), parse_effect(two[1].replace('E2', 'E1'))])
