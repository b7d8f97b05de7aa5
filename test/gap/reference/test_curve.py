"""A channel that follows a curve or that varies is no gain and no noise, (188a), (188b)."""
from dataclasses import replace

import numpy as np
import pytest

from reference_records import chain, diagnose_reference, NOISE
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.gap.settings import load_settings
from ssi_ros.regimes.odd_channels import is_linear

FAMILIES = 'curve of a channel', 'product of channels', 'gain in time'


def curved(samples, curve, channel=1):
    """Return a record of which one channel follows a curve, in its own standard deviations."""
    values = samples.values.copy()
    scale = values[:, channel].std()
    values[:, channel] = scale * curve(values[:, channel] / scale)
    # of the electronics behind it; a sensor that shows nothing at rest repeats its samples
    values[:, channel] += NOISE * np.random.default_rng(9).standard_normal(len(values))
    return replace(samples, values=values)


def odd(comparison):
    """Return what channels do, by family."""
    return {d.basis: d for d in comparison.recordings.odd_channels}


def dead_zone(x):
    """Return what a sensor shows that sees no motion below a third of its rms."""
    return np.sign(x) * np.maximum(np.abs(x) - 0.3, 0.0)


@pytest.fixture(scope='module')
def compared():
    """Return a function that sets a record beside a healthy recording."""
    reference = RecordedNominal(chain(1))
    names = 'sensor_gain', 'sensor_noise'
    return lambda record: reference.compare(record, load_settings(), names)


@pytest.mark.parametrize('curve, text', [
    (dead_zone, 'large motion is too large'), (lambda x: np.tanh(x / 2), 'too small'),
    (lambda x: x + 0.1 * x ** 2, 'one side differs')])
def test_curves_are_seen(compared, curve, text):
    """A dead zone, a sensor that saturates softly, and one that has two slopes."""
    found = odd(compared(curved(chain(2), curve)))['curve of a channel']
    assert found.p_value < 1e-12
    assert 'Channel b' in found.text and text in found.text


def test_a_product_of_two_channels_is_seen(compared):
    """A sensor that is turned by what another one measures."""
    samples = chain(2)
    values = samples.values.copy()
    values[:, 1] += 0.05 * values[:, 0] * values[:, 2] / values[:, 0].std()
    found = odd(compared(replace(samples, values=values)))
    assert found['product of channels'].p_value < 1e-12 and found['gain in time'].p_value > 1e-3
    assert 'Channel b holds a product of a and c' in found['product of channels'].text


def test_a_gain_that_varies_is_seen(compared):
    """By 1 % of its size; the level of all forces may vary by half meanwhile."""
    samples = chain(2)
    phase = 2 * np.pi * np.arange(len(samples.values)) / len(samples.values)
    values = samples.values * (1 + 0.5 * np.sin(5 * phase))[:, None]
    assert odd(compared(replace(samples, values=values)))['gain in time'].p_value > 1e-3
    values[:, 2] *= 1 + 0.02 * np.sin(3 * phase)
    found = odd(compared(replace(samples, values=values)))
    assert 'channel c varies' in found['gain in time'].text
    assert found['gain in time'].p_value < 1e-9
    assert min(found[f].p_value for f in FAMILIES[:2]) > 1e-3


@pytest.mark.slow
def test_what_is_linear_has_no_curve(compared):
    """Healthy records, a gain, and forces of a level that varies: p-values as by chance."""
    records = [chain(s) for s in range(2, 8)]
    records += [curved(chain(s), lambda x: 1.3 * x) for s in range(8, 12)]
    records += [replace(r, values=r.values * (1 + 0.5 * np.sin(np.arange(len(r.values)) / 900))[
        :, None]) for r in map(chain, range(12, 16))]
    found = [odd(compared(r)) for r in records]
    for family in FAMILIES:
        p_values = [f[family].p_value for f in found]
        assert min(p_values) > 1e-3
        # a Bonferroni bound is 1 for half of all, or more
        assert 0.25 < np.mean(p_values)


def test_a_curve_that_was_there_before_is_none():
    """Two recordings by one sensor with a dead zone are within the floor."""
    nominal = RecordedNominal(curved(chain(1), dead_zone))
    found = nominal.compare(curved(chain(2), dead_zone), load_settings(), ('sensor_gain',))
    assert odd(found)['curve of a channel'].p_value > 1e-3


def test_effects_that_make_no_curve():
    """Of sensors and inputs the linear ones; clipped samples and structures may make one."""
    assert is_linear(('sensor_gain', 'sensor_noise', 'excitation_colour'))
    for other in ('saturation', 'hinge_friction', 'impulsive_events', 'stiffness_scale'):
        assert not is_linear(('sensor_gain', other))


@pytest.mark.slow
def test_a_dead_zone_is_unexplained():
    """A gain and noise leave nothing of its spectrum; the curve is what neither makes."""
    found = diagnose_reference(chain(1), curved(chain(2), dead_zone))
    assert found.outcome == 'UNEXPLAINED'
    assert any('Channel b follows a curve' in t for t in found.signs)


def test_a_curve_that_no_spectrum_shows():
    """What a third-order polynomial makes of a hundredth of a channel hides in its noise."""
    record = curved(chain(2), lambda x: x + 0.01 * (x ** 3 - 3 * x))
    found = diagnose_reference(chain(1), record)
    assert found.gap['before'] < found.gap['floor'] + 2 * found.gap['floor_std']
    assert found.outcome == 'UNEXPLAINED' and 'Channel b follows a curve' in found.signs[0]
