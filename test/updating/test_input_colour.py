"""The colour of the excitation: found in a healthy recording, and not where there is none."""
from dataclasses import replace
import math

import craft
import numpy as np
import pytest
from ssi_ros.effects import inject, load_configuration, save_configuration, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.uncertainty import Uncertainty
from ssi_ros.updating.calibrate import calibrate

CORNERS = {'torque_corner_hz': 8.0, 'process_corner_hz': 3.0}


def record(seed, **corners):
    """Return a record of the twin under an excitation whose corners its model does not state."""
    twin = craft.twin()
    driven = replace(twin, excitation=replace(twin.excitation, **corners))
    return simulate_setup(inject(driven, (), craft.SECONDS), seed)


@pytest.fixture(scope='module')
def calibrated():
    """Return the model calibrated on a record whose forces on the modes are coloured."""
    return calibrate(craft.model(), [record(11, **CORNERS)])


@pytest.mark.slow
def test_a_corner_that_the_model_does_not_state_is_found(calibrated):
    """Within what is said of it; the recording is explained, and the sentence names the corner."""
    found = calibrated.spacecraft.excitation
    assert calibrated.explains
    off = np.log(found.process_corner_hz / CORNERS['process_corner_hz'])
    assert abs(off) < 3.5 * found.process_corner_std and found.process_corner_std < 0.1
    assert any('forces on the modes have passed a low-pass' in n for n in calibrated.notes)


@pytest.mark.slow
def test_errors_beside_a_colour_are_as_sure_as_they_say(calibrated):
    """A colour that is taken for errors of the structure turns them by many deviations."""
    truth = np.array(craft.twin().calibration.values)
    z = (calibrated.fit.values - truth) / np.sqrt(np.diag(calibrated.fit.covariance))
    assert np.sqrt(np.mean(z ** 2)) < 1.4


def test_the_next_healthy_record_is_within_the_floor(calibrated, tmp_path):
    """Also after the model was written and read; what is known of the corner goes with it."""
    path = tmp_path / 'calibrated.yaml'
    save_configuration(calibrated.spacecraft, (), path)
    spacecraft, _ = load_configuration(path)
    assert spacecraft.excitation == calibrated.spacecraft.excitation
    assert diagnose(spacecraft, record(12, **CORNERS)).outcome == 'WITHIN_FLOOR'


@pytest.mark.slow
def test_gaps_filled_by_a_wrong_model_are_no_colour():
    """The corner was 8.6 of its deviations off, by what filled the gaps first; bound 5."""
    model = replace(craft.model(), noise_rms_m_s2=1e-5, uncertainty=Uncertainty(
        frequency=0.03, participation=0.03, shape=0.03))
    names, stds = declared(model)
    twin = replace(model, calibration=Calibration(
        names, stds * np.random.default_rng(1).standard_normal(len(stds))),
        excitation=replace(model.excitation, torque_corner_hz=8.0, process_corner_hz=60.0))
    samples = simulate_setup(inject(twin, (), 200.0), 1)
    values = samples.values.copy()
    for begin in np.arange(0.05, 0.95, 0.1) * len(values):
        values[int(begin):int(begin) + 36] = np.nan         # nine of 0.9 s
    found = calibrate(model, [replace(samples, values=values)]).spacecraft.excitation
    assert abs(np.log(found.process_corner_hz / 60.0)) < 5 * found.process_corner_std
    assert found.process_corner_std < 0.2


@pytest.mark.slow
def test_a_white_excitation_stays_white():
    """No corner is written, and nothing is said of one."""
    found = calibrate(craft.model(), [record(13)])
    assert math.isinf(found.spacecraft.excitation.process_corner_hz)
    assert math.isinf(found.spacecraft.excitation.torque_corner_hz)
    assert found.explains and not any('low-pass' in n for n in found.notes)


def test_corners_are_part_of_what_is_simulated():
    """The power of a channel falls as the low-pass says, to 10 % in a wide band."""
    rows, levels = [], []
    for corner in (math.inf, 3.0):
        samples = record(14, torque_corner_hz=corner, process_corner_hz=corner)
        values = samples.values[:, 0] - samples.values[:, 0].mean()
        power = np.abs(np.fft.rfft(values)) ** 2
        rows.append(np.fft.rfftfreq(len(values), 1 / samples.rate_hz))
        levels.append(power[(rows[-1] > 6.0) & (rows[-1] < 7.0)].sum())
    assert levels[1] / levels[0] == pytest.approx(1 / (1 + (6.4 / 3.0) ** 2), rel=0.1)
