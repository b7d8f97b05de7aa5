"""What errors of a model put off the amplitudes, heights and ends that a test finds in inputs."""
from dataclasses import replace
from types import SimpleNamespace

from craft import model
import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.model_comparison import ModelComparison
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.updating.prior import known_by_recordings, stand
from ssi_ros.updating.transfer_doubt import beside_errors

SETTINGS, DRAWS = DiagnosisSettings(), 60
SCALE = 0.02            # of the declared errors: the most that one is known by recordings


@pytest.fixture(scope='module')
def beside():
    """Return a calibrated model side, and a Fit with no errors of its own."""
    names, stds = declared(model())
    craft = replace(model(), calibration=Calibration(
        names, np.zeros(len(names)), np.diag((SCALE * stds) ** 2)))
    simulator = Simulator(craft, make_frame(60_000, 100.0, SETTINGS), 600.0)
    expected = simulator.expected(Candidate())
    side = stand(simulator, known_by_recordings(craft.calibration),
                 np.ones(len(expected.names)), SETTINGS)
    return side, SimpleNamespace(plain=expected.at_nominal,
                                 errors=np.zeros(len(side.uncertainty.names)))


def found(text, **stds):
    """Return the Detection of an effect, its deviations nearly nought."""
    effect = parse_effect(text)
    return Detection.of_effect(effect, 1e-9, '', stds={effect.size: 1e-9} | stds)


def test_a_line_is_off_by_what_the_transfer_function_is(beside):
    """Of models at errors that are drawn, each with the line in it, in the mean over draws."""
    side, state = beside
    text, at_hz = 'harmonic_disturbance:frequency_hz=12.3,torque_n_m=2', np.array([12.3])
    std = beside_errors(found(text), side, state, side, state).stds['torque_n_m']
    spectrum = state.plain[0][np.argmin(np.abs(side.simulator.frame.frequencies_hz - 12.3))]

    def transfer(simulator):
        system = simulator.setup(Candidate()).system
        return system.transfer(at_hz, system.rate_hz, slice(1))[0, :, 0]
    usual, rng = transfer(side.simulator), np.random.default_rng(1)
    toward = np.linalg.solve(spectrum, usual).conj()
    amplitudes = [2 * np.abs(toward @ transfer(side.simulator.at_errors(
        side.prior.root @ rng.standard_normal(len(side.prior.root))))) / (toward @ usual).real
        for _ in range(DRAWS)]
    # 3.5 deviations of a deviation of sixty; the record itself would narrow the errors down
    scatter = np.sqrt(np.mean(np.square(np.array(amplitudes) - 2)))
    assert 0.0 < std < scatter * (1 + 3.5 / np.sqrt(2 * DRAWS))
    assert std > 0.2 * scatter


def test_an_amplitude_is_corrected_by_the_most_probable_errors(beside):
    """A line in the model at errors, found with the one without, is as high as it was made."""
    side, state = beside
    one = found('harmonic_disturbance:frequency_hz=12.3,torque_n_m=2')
    rng = np.random.default_rng(2)
    there = SimpleNamespace(plain=state.plain, errors=np.where(
        [n.startswith('error') for n in side.uncertainty.names],
        3 * rng.standard_normal(len(state.errors)), 0.0))
    values = dict(zip(side.uncertainty.names, there.errors))
    errors = np.array([values[n] for n in side.errors.names])
    at = side.prior.root @ (side.errors.into @ side.prior.root).T @ errors
    spectrum = state.plain[0][np.argmin(np.abs(side.simulator.frame.frequencies_hz - 12.3))]
    usual, moved = (s.setup(Candidate()).system.transfer(
        np.array([12.3]), 100.0, slice(1))[0, :, 0] for s in (
            side.simulator, side.simulator.at_errors(at)))
    toward = np.linalg.solve(spectrum, usual).conj()
    ratio = (toward @ moved).real / (toward @ usual).real
    stood = stand(side.simulator.at_errors(at), side.prior, side.levels, SETTINGS)
    none = SimpleNamespace(errors=np.zeros(len(stood.uncertainty.names)))
    assert abs(ratio - 1) > 0.01
    for beside_it, fitted in (side, there), (stood, none):  # errors fitted, or stood at
        height = beside_errors(one, side, state, beside_it, fitted).parameters['torque_n_m']
        assert height * ratio == pytest.approx(2.0, abs=0.2 * 2 * abs(ratio - 1))


def test_the_ends_of_a_sweep_move_with_the_phase(beside):
    """The faster it passes, the less of a turn is a phase: both ends count, as does the torque."""
    side, state = beside
    one = found('wheel_speed_sweep:start_hz=3,end_hz=20,torque_n_m=0.2', start_hz=0.0, end_hz=0.0)
    stds = beside_errors(one, side, state, side, state).stds
    assert stds.keys() == {'torque_n_m', 'start_hz', 'end_hz'}
    assert all(0.0 < stds[n] < 0.01 for n in ('start_hz', 'end_hz')) and stds['torque_n_m'] > 1e-5


def test_nothing_is_added_of_an_exact_model_or_of_another_effect(beside):
    """A gain is none of the input."""
    side, state = beside
    line = found('harmonic_disturbance:frequency_hz=12.3,torque_n_m=2')
    exact = ModelComparison.__new__(ModelComparison)
    assert exact.detected_beside(SimpleNamespace(names=(line.effect,)), (line,)) == (line,)
    gain = found('sensor_gain:channel=e1_a,scale=1.1')
    assert beside_errors(gain, side, state, side, state) is gain
