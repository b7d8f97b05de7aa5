"""Effects far from every start, where no score says which it is or how large."""
from dataclasses import replace

import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.effects.sizes import brackets, LARGE
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.starting_points import at_any_size
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT

CHANNEL = ('sensor_misplacement', 'sensor_gain', 'sensor_noise', 'sensor_bandwidth')


def sizes(text, *args):
    """Return the sizes that `brackets` gives an effect."""
    return [getattr(e, e.size) for e in brackets(parse_effect(text), *args)]


def test_brackets_go_from_none_both_ways_within_the_range():
    """A gain may be less; a mass not, nor a scale below its lowest."""
    assert sizes('added_mass:mass_kg=1', 0.01, LARGE)[::3] == pytest.approx(
        [0.04, 0.32, 2.56, 20.48])
    both = sizes('sensor_gain:scale=1.01', 0.02, (4.0, 32.0, 256.0))
    assert both == pytest.approx([0.92, 0.36, 1.08, 1.64, 6.12])


def test_brackets_of_what_is_less_the_more_it_changes():
    """A low-pass has no effect at an infinite corner."""
    assert sizes('sensor_bandwidth:channel=all,corner_hz=1000', None, (1.0, 4.0)) == [
        1000.0, 250.0]


def test_the_most_likely_kinds_come_at_all_their_sizes():
    """Starts of one kind at one place are tried once, from the nearest of its sizes."""
    starts = [parse_effect(t) for t in (
        'stiffness_scale:scale=0.99', 'stiffness_scale:scale=1.01', 'damping_scale:scale=1.1',
        'sensor_gain:channel=e1_a,scale=1.01', 'sensor_gain:channel=e1_b,scale=1.01')]
    asked = []

    def likelihood(effect):
        asked.append(effect)
        return {'sensor_gain': 2.0, 'damping_scale': 1.0}.get(effect.name, 0.0) - abs(
            getattr(effect, 'channel', 'e1_b') != 'e1_b')
    first, second = at_any_size(starts, likelihood, 2)
    assert {e.channel for e in first} == {'e1_b'} and len(first) > 8
    assert {e.name for e in second} <= {'damping_scale', 'sensor_gain'}
    assert len(asked) == len(set(asked))


@pytest.mark.slow
def test_a_sensor_a_metre_from_its_place_is_found():
    """Its scores said noise and a low-pass, of which 100 deviations were left."""
    spacecraft = replace(load_spacecraft(), uncertainty=EXACT)
    moved = parse_effect('sensor_misplacement:channel=e1_b,along_m=-1.0,lateral_m=0.3')
    record = simulate_setup(inject(spacecraft, (moved,), 150.0), 51)
    found = diagnose(spacecraft, record, effects=CHANNEL)
    assert found.outcome == 'EXPLAINED'
    first = found.to_json()['candidates'][0]
    assert first['effects'] == ['sensor_misplacement']
    place = {k.split('.')[1]: v for k, v in first['parameters'].items()}
    assert place['along_m']['value'] == pytest.approx(-1.0, abs=4 * place['along_m']['std'])
