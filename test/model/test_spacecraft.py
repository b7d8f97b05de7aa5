"""The numbers of a spacecraft: defaults, YAML and what is refused."""
from dataclasses import replace

import pytest
from ssi_ros.model.spacecraft import (
    Hub, load_spacecraft, Plate, save_spacecraft, Sensor, SolarArray, Spacecraft)


def test_packaged_file_is_the_default():
    """The YAML file and the declared defaults say the same."""
    assert load_spacecraft() == Spacecraft()


def test_yaml_round_trip(tmp_path):
    """What is written is read back unchanged, infinite stiffness included."""
    craft = replace(Spacecraft(), rate_hz=50.0, hub=Hub(((500, 1, 0), (1, 300, 2), (0, 2, 700))))
    save_spacecraft(craft, tmp_path / 'craft.yaml')
    assert load_spacecraft(tmp_path / 'craft.yaml') == craft


@pytest.mark.parametrize('make, words', [
    (lambda: Plate(density_kg_m3=-88.0), ['density_kg_m3=-88', 'kg/m^3']),
    (lambda: Plate(stiffness_n_m=-1.0), ['stiffness_n_m=-1', 'N m']),
    (lambda: Plate(poisson_ratio=0.7), ['poisson_ratio=0.7', '0.499']),
    (lambda: Hub(((1, 2, 0), (0, 1, 0), (0, 0, 1))), ['not symmetric', 'both sides']),
    (lambda: Hub(((1, 2, 0), (2, 1, 0), (0, 0, 1))), ['-1 kg m^2', 'positive']),
    (lambda: Hub(((1, 0), (0, 1))), ['three rows']),
    (lambda: SolarArray(side=0), ['side=0', '+1']),
    (lambda: Spacecraft(sensors=(Sensor('a', 'E1', 8.1, 0.0),)), ['8.1', '0 to 8', 'move it']),
    (lambda: Spacecraft(sensors=(Sensor('a', 'E9', 1.0, 0.0),)), ["'E9'", 'E1, E2']),
    (lambda: Spacecraft(sensors=(Sensor('a'), Sensor('a'))), ['own name']),
    (lambda: Spacecraft(momentum_n_m_s=(1.0,)), ['momentum_n_m_s', 'three']),
])
def test_bad_numbers_are_refused(make, words):
    """The message names the value, the limit and what to do."""
    with pytest.raises(ValueError) as error:
        make()
    assert all(word in str(error.value) for word in words), str(error.value)


def test_bad_files_are_refused(tmp_path):
    """A misspelt key names its neighbours; what is not YAML is said to be so."""
    path = tmp_path / 'craft.yaml'
    path.write_text('rate_hzz: 100.0')
    with pytest.raises(ValueError, match='did you mean rate_hz'):
        load_spacecraft(path)
    path.write_text('rate_hz: [')
    with pytest.raises(ValueError, match='is not YAML'):
        load_spacecraft(path)
