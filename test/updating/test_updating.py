"""Models that are wrong: errors of single numbers, calibration, diagnosis with what is unknown."""
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

from craft import model, record, SECONDS, twin
import numpy as np
import pytest
from ssi_ros.effects import load_configuration, parse_effect, save_configuration
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.whittle import BLAS
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import assemble, natural_modes
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.uncertainty import EXACT, ModeUncertainty, Uncertainty
from ssi_ros.updating.calibrate import calibrate
from ssi_ros.updating.compensation import Compensation

GAIN = 'sensor_gain:channel=e1_a,scale=1.06'


@lru_cache
def calibrated():
    """Return the model calibrated on one healthy record."""
    return calibrate(model(), [record(10)], names=['healthy'])


@pytest.mark.parametrize('name, matrix, at, ratio', [
    ('frequency E1 1', 'stiffness', (3, 3), 1.01 ** 2),
    ('shape E1 1 e1_a', 'sensor', (0, 3), 1.01),
    ('participation E1 1', 'mass', (0, 3), 1.01)])
def test_an_error_changes_its_own_number(name, matrix, at, ratio):
    """One per cent of an error is one per cent of what it is named after, and of nothing else."""
    nominal = assemble(model())
    wrong = assemble(replace(model(), calibration=Calibration((name,), (0.01,))))
    assert getattr(wrong, matrix)[at] == pytest.approx(ratio * getattr(nominal, matrix)[at])
    changed = {m for m in ('mass', 'stiffness', 'sensor')
               if not np.array_equal(getattr(wrong, m), getattr(nominal, m))}
    assert changed == {matrix}
    # the freedom of that mode alone, in what couples it to the hub, to itself or to a channel
    assert all(3 in place for place in np.argwhere(
        getattr(wrong, matrix) != getattr(nominal, matrix)))


def test_the_place_of_a_sensor_moves_its_row():
    """To first order the row is that of a sensor that stands elsewhere."""
    sensor = replace(model().sensors[0], along_m=6.0)
    at = replace(model(), sensors=(sensor, *model().sensors[1:]))
    moved = replace(at, sensors=(replace(sensor, along_m=6.005), *model().sensors[1:]))
    wrong = replace(at, calibration=Calibration(('along e1_a',), (0.005,)))
    step = assemble(moved).sensor - assemble(at).sensor
    assert assemble(wrong).sensor - assemble(at).sensor == pytest.approx(
        step, abs=2e-3 * np.abs(step).max())


def test_what_is_known_of_one_mode_is_taken():
    """A number of one mode replaces that of all; what is exact is no error."""
    given = Uncertainty(frequency=0.02, damping=0.0, participation=0.0, shape=0.0,
                        hub_inertia=0.0, gain=0.0, sensor_place_m=0.0, modal_force=0.0,
                        modes=(ModeUncertainty('E2', 3, frequency=0.001, damping=0.0,
                                               participation=0.0, shape=0.0),))
    names, stds = declared(replace(model(), uncertainty=given))
    assert len(names) == 8 and dict(zip(names, stds))['frequency E2 3'] == 0.001
    assert not given.exact and EXACT.exact


@pytest.mark.parametrize('names, values, words', [
    (('frequency E9 1',), (0.01,), 'is not known'), (('gain e1_a',), (0.1, 0.2), '2 values')])
def test_a_wrong_calibration_is_an_error(names, values, words):
    """An error of nothing that is there, and lists that do not fit."""
    with pytest.raises(ValueError, match=words):
        assemble(replace(model(), calibration=Calibration(names, values)))


@pytest.mark.slow
def test_errors_are_found_within_their_deviations():
    """Frequencies off by many line widths are found, each known as well as it says."""
    fit = calibrated().fit
    z = (fit.values - np.array(twin().calibration.values)) / np.sqrt(np.diag(fit.covariance))
    kinds = np.array([n.split()[0] for n in fit.names])
    for kind in ('frequency', 'damping', 'shape'):
        assert 0.5 < np.sqrt(np.mean(z[kinds == kind] ** 2)) < 1.6, kind
    real, found, before = (natural_modes(assemble(c)).frequencies_hz for c in (
        twin(), calibrated().spacecraft, model()))
    assert np.abs(found / real - 1).max() < 0.3 * np.abs(before / real - 1).max()
    assert calibrated().explains and calibrated().checks[0].before > 0.1


@pytest.mark.slow
def test_short_gaps_of_a_healthy_record_are_filled_by_the_moved_model():
    """Filled by the model as it is declared, they cost 100 nats, and the record is refused."""
    whole = record(10)
    values, draws = whole.values.copy(), np.random.default_rng(4)
    for begin in draws.integers(100, len(values) - 100, 30):
        values[begin:begin + 20] = np.nan
    found = calibrate(model(), [replace(whole, values=values)])
    away = found.fit.values - np.array(twin().calibration.values)
    assert found.explains
    assert away @ np.linalg.solve(found.fit.covariance, away) < 1.5 * len(away)


def test_a_calibrated_model_is_kept_in_a_file(tmp_path):
    """What is written is read back, and is short enough to be looked at."""
    save_configuration(calibrated().spacecraft, (), tmp_path / 'calibrated.yaml')
    again, _ = load_configuration(tmp_path / 'calibrated.yaml')
    one, two = calibrated().spacecraft.calibration, again.calibration
    assert one.names == two.names and one.values == two.values
    assert np.allclose(one.covariance, two.covariance, rtol=1e-5)
    assert two.recordings == ('healthy',)


def test_another_level_is_no_gap_to_a_calibrated_model():
    """Inputs 6 dB up and down, each on its own."""
    found = diagnose(calibrated().spacecraft, record(11, torque=2.0, process=0.5))
    assert found.outcome == 'WITHIN_FLOOR'


@pytest.mark.slow
def test_forces_on_single_modes_are_no_gap_and_no_error():
    """Each 3 dB up or down: quiet beside a calibration, and no shape is blamed by another one."""
    assert diagnose(calibrated().spacecraft, record(14, forces_db=3.0)).outcome == 'WITHIN_FLOOR'
    found = calibrate(model(), [record(15, forces_db=3.0), record(16, forces_db=3.0)])
    away = found.fit.values - np.array(twin().calibration.values)
    shapes = [n.split()[0] in ('shape', 'participation') for n in found.fit.names]
    std = np.sqrt(np.diag(found.spacecraft.calibration.covariance))
    assert found.explains and np.sqrt(np.mean(np.square(away / std)[shapes])) < 1.5


@pytest.mark.slow
def test_a_gain_is_found_with_a_calibrated_model():
    """At another level, with its size."""
    found = diagnose(calibrated().spacecraft, record(12, GAIN, torque=0.5, process=2.0))
    assert found.verdict['effects'] == ('sensor_gain',)
    value = found.candidates[0].parameters['sensor_gain.scale']
    assert abs(value.value - 1.06) < 4 * value.std < 0.06


@pytest.mark.slow
def test_several_recordings_add_their_scatter():
    """A frequency that differs from day to day is known no better than that."""
    craft = twin().at_errors([v + 0.004 * n.startswith('frequency') for n, v in zip(
        twin().calibration.names, twin().calibration.values)])
    from ssi_ros.effects import inject, simulate_setup
    other = simulate_setup(inject(craft, (), SECONDS), 14)
    both = calibrate(model(), [record(10), other])
    at = [i for i, n in enumerate(both.fit.names) if n.startswith('frequency')]
    assert np.median(both.scatter[at]) > 0.001
    assert np.all(np.diag(both.spacecraft.calibration.covariance) >= both.scatter ** 2)


@pytest.mark.slow
def test_a_model_alone_may_be_as_wrong_as_it_declares():
    """Without a healthy recording, and at other levels: no alarm."""
    quiet = diagnose(model(), record(15, torque=1.5, process=0.7))
    assert quiet.outcome == 'WITHIN_FLOOR'


@pytest.mark.slow
def test_a_line_has_no_number_that_is_fitted_beside_errors():
    """Its frequency and torque are those of its detection."""
    found = diagnose(model(), record(
        18, 'harmonic_disturbance:frequency_hz=7.3,torque_n_m=0.3', torque=0.7))
    assert found.outcome == 'EXPLAINED' and found.verdict['effects'] == ('harmonic_disturbance',)
    parameters = found.candidates[0].parameters
    assert parameters['harmonic_disturbance.frequency_hz'].value == pytest.approx(7.3, abs=1e-3)
    assert parameters['harmonic_disturbance.torque_n_m'].value == pytest.approx(0.3, rel=0.05)


@pytest.mark.slow
def test_a_fault_of_a_sensor_is_found_beside_errors_of_the_model():
    """Without a healthy recording."""
    found = diagnose(model(), record(16, 'sensor_noise:channel=e1_a,scale=6', torque=0.7))
    assert 'sensor_noise' in found.verdict['class']


@pytest.mark.slow
def test_an_error_of_the_model_ties_with_an_effect_that_is_the_same():
    """A stiffness 0.2 % off is nothing that a model of 1 % could show."""
    from ssi_ros.effects import inject, simulate_setup
    setup = inject(model(), [parse_effect('stiffness_scale:scale=0.996')], SECONDS)
    found = diagnose(model(), simulate_setup(setup, 17))
    if found.outcome != 'WITHIN_FLOOR':
        assert found.outcome == 'TIED' and 'model_error' in found.verdict['class']
        assert any('healthy' in words for words in found.separate_by)
    exact = replace(model(), uncertainty=EXACT)
    assert 'stiffness_scale' in diagnose(exact, simulate_setup(setup, 17)).verdict['class']


@pytest.mark.slow
def test_a_first_fit_goes_on_while_it_rises():
    """A soft hinge is far from a stiff one: the first eight steps gain 108 of 260 nats."""
    texts = [f'hinge_compliance:array=E2,stiffness_n_m_rad={k}' for k in (60_000, 12_000_000)]
    with BLAS.limit(limits=1):
        comparison = ModelNominal(model()).compare(
            record(11, texts[0]), DiagnosisSettings(), ('hinge_compliance',), lambda share: None)
        first = comparison.fit(Candidate((parse_effect(texts[1]),)), comparison.null, None, False)
        end = comparison.fit(first.candidate, first)
    assert end.log_likelihood - comparison.null.log_likelihood > 200.0
    assert first.log_likelihood == pytest.approx(end.log_likelihood, abs=2.0)
    assert first.candidate.effects[0].stiffness_n_m_rad == pytest.approx(60_000, rel=0.1)


def test_nothing_to_calibrate_is_an_error():
    """A model that is declared exact."""
    with pytest.raises(ValueError, match='declared exact'):
        calibrate(replace(model(), uncertainty=EXACT), [record(10)])


@pytest.mark.parametrize('text', [
    'stiffness_scale:scale=0.9', 'array_asymmetry:array=E1,scale=0.97', 'clock_rate:ppm=12000'])
def test_errors_take_back_what_an_effect_moves(text):
    """Beside the effect, the shifted model has the frequencies that it had without."""
    frame = make_frame(round(SECONDS * 40), 40.0, DiagnosisSettings())
    simulator = Simulator(twin(), frame, SECONDS)
    names, stds = declared(model())
    effect = Candidate((parse_effect(text),))
    shift = Compensation(simulator, names, stds).shift(effect)
    moved = twin().at_errors(np.array(twin().calibration.values) + shift)
    home, there, before = (
        natural_modes(s.system).frequencies_hz * s.stamp_rate_hz / s.system.rate_hz
        for s in (simulator.setup(Candidate()),
                  simulator.but(spacecraft=moved).setup(effect), simulator.setup(effect)))
    assert np.abs(there / home - 1).max() < 0.05 * np.abs(before / home - 1).max()


@pytest.mark.slow
def test_errors_are_as_rare_as_they_are():
    """At its own calibration a model has usual errors; three deviations of each are not."""
    known = calibrated().spacecraft
    comparison = ModelNominal(known).compare(
        record(16), DiagnosisSettings(), ('sensor_gain',), lambda share: None)
    frame, state = comparison.record.spectra.frame, comparison.null.state
    assert comparison.here.chance_of_errors(state, frame) > 0.01
    far = SimpleNamespace(errors=np.full(len(state.errors), 3.0))
    assert comparison.here.chance_of_errors(far, frame) < 1e-6
    alone = ModelNominal(model()).compare(
        record(16), DiagnosisSettings(), ('sensor_gain',), lambda share: None)
    assert alone.here.chance_of_errors(far, frame) == 1.0
