"""The sentence that answers: the size first, its probability, what correcting it removes."""
import pytest
from ssi_ros.report.wording import headline, label, size_text


def found(outcome='EXPLAINED', closed=0.984, **parameters):
    """Return the JSON of a diagnosis with one candidate."""
    effects = list(dict.fromkeys(k.partition('.')[0] for k in parameters))
    return {'outcome': outcome, 'reason': 'a reason', 'verdict': {
        'effects': effects, 'class': list(effects), 'probability': 0.857}, 'candidates': [{
            'effects': effects, 'probability': 0.857, 'closed': closed,
            'parameters': parameters}]}


def value(value, std=None, unit='1'):
    """Return a parameter as the JSON has it."""
    return {'value': value, 'std': std, 'low90': None, 'high90': None, 'unit': unit}


ARRAY = {'array_asymmetry.array': value('E1', unit=''),
         'array_asymmetry.scale': value(1.02049, 3.1e-4)}


def test_size_probability_and_share():
    """One sentence, the place with the size."""
    assert headline(found(**ARRAY)) == (
        'array_asymmetry: scale of array E1 is 1.0205 +- 0.0003 (probability 0.86); '
        'correcting it removes 98 % of the gap')


def test_more_than_all_is_called_noise():
    """A share above 100 % is possible on held-out data, and means nothing."""
    assert headline(found(closed=1.32, **ARRAY)).endswith(
        'removes all of the gap')
    assert headline(found(closed=0.999, **ARRAY)).endswith('removes more than 99 % of the gap')
    assert 'too small to say' in headline(found(closed=None, **ARRAY))


def test_two_effects_and_a_place_without_geometry():
    """Both sizes stand in the sentence; a channel may be part of a parameter's name."""
    said = headline(found(**{
        'hub_inertia.scale': value(1.3042, 0.0148), 'sensor_gain.channel.e2_b': value(1.0),
        'sensor_gain.scale': value(1.03837, 0.0014)}))
    assert said.startswith('hub_inertia: scale is 1.30 +- 0.01, and sensor_gain: scale of channel '
                           'e2_b is 1.038 +- 0.001 (probability 0.86); correcting both removes')


def test_a_change_near_a_channel_says_so():
    """It is no property of the channel."""
    said = headline(found(**{'stiffness_scale.near.c5': value(0.98), **{
        f'stiffness_scale.scale_at_{f}_mhz': value(0.99, 0.001) for f in range(1000, 9000, 500)}}))
    assert said.startswith('stiffness_scale: scale of 16 modes by a change near c5 is 0.99 to ')


def test_a_tie_names_the_others():
    """What the record cannot distinguish is said in the same breath."""
    tie = found('TIED', **ARRAY)
    tie['verdict']['class'] += ['stiffness_scale', 'hub_inertia']
    assert headline(tie).endswith(
        '. The record does not distinguish it from stiffness_scale and hub_inertia; the '
        'probability of all of them together is 0.86')


@pytest.mark.parametrize('outcome', ['WITHIN_FLOOR', 'UNEXPLAINED', 'TOO_LITTLE_DATA'])
def test_without_an_explanation_the_reason_stands(outcome):
    """No size is claimed where no effect explains the gap."""
    assert headline(found(outcome, **ARRAY)) == 'a reason'


@pytest.mark.parametrize('number, std, unit, text', [
    (101_055.7, 3705.0, 'N m/rad', '101000 +- 4000 N m/rad'),
    (2.4579e15, 8.4e14, 'N m/rad^3', '2.5e+15 +- 8e+14 N m/rad^3'),
    (19.7, 2912.0, 'kg', '20 +- 3000 kg'),
    (3.1e-9, 2e-10, 'm', '3.1e-09 +- 2e-10 m'),
    (-10_000.01, None, '1e-6', '-10000 ppm'),
    (0.0, 0.001, '1', '0.000 +- 0.001')])
def test_numbers_end_where_their_deviation_begins(number, std, unit, text):
    """No digit that the standard deviation denies, whatever the magnitude."""
    assert size_text(value(number, std, unit)) == text


@pytest.mark.parametrize('name, unit, text', [
    ('rms_m_s2', 'm/s^2', 'rms'), ('k3_n_m_rad3', 'N m/rad^3', 'k3'),
    ('rate_per_min', '1/min', 'rate'), ('time_constant_s', 's', 'time constant'),
    ('scale_at_5302_mhz', '1', 'scale at 5.302 Hz'), ('ppm', '1e-6', 'error')])
def test_units_leave_the_names(name, unit, text):
    """The unit stands behind the number, not in the name."""
    assert label(name, unit) == text
