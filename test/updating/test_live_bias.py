"""The live meter beside a calibrated model: what the calibration left unknown is no alarm."""
from dataclasses import replace

from craft import model, record, twin
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.online.calibration import LiveSettings, prepare
from ssi_ros.gap.online.sliding import LiveGap
from ssi_ros.updating.calibrate import calibrate

SETTINGS = LiveSettings(window_s=60.0, hop_s=10.0, false_alarm_every_s=3600.0)
WATCHED = ('sensor_gain', 'array_asymmetry', 'hub_inertia', 'damping_scale', 'sensor_noise')
SECONDS = 3000.0


@pytest.fixture(scope='module')
def calibrated():
    return calibrate(model(), [record(10)]).spacecraft


def highest(spacecraft, *texts):
    """Return the highest level of the alarm over a record of the twin, 0 is an alarm."""
    samples = simulate_setup(inject(twin(), [parse_effect(t) for t in texts], SECONDS), 77)
    live = LiveGap(prepare(spacecraft, SETTINGS, effects=WATCHED), samples.channels,
                   samples.start_ns, SETTINGS)
    return max(u.alarm_level for u in live.push(samples.values))


@pytest.mark.slow
def test_what_a_calibration_left_unknown_is_no_alarm(calibrated):
    """A healthy stream is quiet; taken for exact, the same model raises an alarm."""
    taken_for_exact = replace(calibrated, calibration=replace(
        calibrated.calibration, covariance=()))
    assert highest(calibrated) < 0.0 < highest(taken_for_exact)


@pytest.mark.slow
def test_a_change_is_an_alarm_all_the_same(calibrated):
    """A gain of 10 %, a hundred times what is unknown of it."""
    assert highest(calibrated, 'sensor_gain:channel=e1_a,scale=1.1') > 0.0
