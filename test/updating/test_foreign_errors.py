"""Models of matrices that may be wrong: derivatives, calibration, diagnosis."""
from dataclasses import replace
from functools import lru_cache

from examples.shear_building import shear_building
import numpy as np
import pytest
from slope_quotients import assert_slopes_are_quotients
from ssi_ros.cli.main import main
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import save_model
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.modal_errors import modal_uncertainty
from ssi_ros.updating.calibrate import calibrate
from ssi_ros.updating.compensation import Compensation

SECONDS = 1800.0
SOFT = 'connection_stiffness:freedom=floor_2,to=floor_3,share=-0.08'
SOME = 'connection_stiffness', 'sensor_gain', 'mode_damping'


@lru_cache
def model():
    """Return the building with errors of an untested model."""
    plain = shear_building()
    return replace(plain, uncertainty=modal_uncertainty(
        plain, frequency=0.01, damping=0.3, participation=0.03, shape=0.03, gain=0.001))


@lru_cache
def twin(seed=1):
    """Return the building that is recorded: each number off by its declared deviation."""
    names, stds = declared(model())
    return replace(model(), calibration=Calibration(
        names, stds * np.random.default_rng(seed).standard_normal(len(stds))))


def record(seed, *texts):
    """Return a record of the twin with effects."""
    return simulate_setup(inject(twin(), [parse_effect(t) for t in texts], SECONDS), seed)


@pytest.mark.parametrize('text', [
    '', SOFT, 'sensor_gain:channel=gnss,scale=1.1', 'point_mass:freedom=floor_2,share=0.05',
    'channel_delay:channel=acc_1,delay_s=0.003'])
def test_derivatives_are_those_of_difference_quotients(text):
    """Of accelerations and a displacement, by all errors, those of the inputs as well."""
    frame = make_frame(36000, 20.0, DiagnosisSettings(segment_s=60.0, band_bins=1))
    assert_slopes_are_quotients(Simulator(twin(), frame, SECONDS), declared(model())[1], text)


def test_errors_take_back_what_an_effect_moves():
    """A softer spring beside errors that keep the frequencies of the record."""
    names, stds = declared(model())
    frame = make_frame(36000, 20.0, DiagnosisSettings())
    side = Simulator(replace(model(), calibration=Calibration(names, np.zeros(len(names)))),
                     frame, SECONDS)
    candidate = Candidate((parse_effect(SOFT.replace('0.08', '0.02')),))

    def frequencies(values):
        setup = side.at_errors(values).setup(candidate)
        return np.sqrt(np.linalg.eigvals(np.linalg.solve(
            setup.system.mass, setup.system.stiffness)).real)
    shift = Compensation(side, names, stds).shift(candidate)
    home = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.solve(
        model().mass, model().stiffness)).real))
    before, after = (np.abs(np.sort(frequencies(v)) / home - 1).max()
                     for v in (np.zeros(len(names)), shift))
    assert before > 1e-3 and after < 0.1 * before


@pytest.mark.slow
def test_a_wrong_model_calibrated_names_a_softer_spring():
    """Errors within their deviations, no alarm on a healthy record, the effect in its place."""
    found = calibrate(model(), [record(51)], names=['healthy'])
    z = (found.fit.values - np.array(twin().calibration.values)) / np.sqrt(
        np.diag(found.fit.covariance))
    assert np.sqrt(np.mean(z ** 2)) < 1.5 and found.explains
    quiet = diagnose(ModelNominal(found.spacecraft), record(2))
    assert quiet.outcome == 'WITHIN_FLOOR'
    soft = diagnose(ModelNominal(found.spacecraft), record(3, SOFT), effects=SOME, pairs=False)
    assert soft.verdict['effects'] == ('connection_stiffness',)
    assert soft.candidates[0].built[0].share == pytest.approx(-0.08, abs=0.02)


@pytest.mark.slow
def test_the_verbs_take_it(tmp_path, capsys):
    """`model` tells what is declared, `calibrate` writes a model that `diagnose` reads."""
    file, real = str(tmp_path / 'model.npz'), str(tmp_path / 'real.npz')
    save_model(model(), file)
    save_model(twin(), real)
    assert main(['model', file]) == 0
    assert 'frequency 1 %, damping 30 %' in capsys.readouterr().out
    bag, out = str(tmp_path / 'healthy'), str(tmp_path / 'calibrated.npz')
    assert main(['simulate', bag, '--model', real, '--duration-s', '1800']) == 0
    words = ['calibrate', bag, '--model', file, '--output']
    assert main([*words, str(tmp_path / 'calibrated.yaml')]) == 2
    assert 'must end in .npz' in capsys.readouterr().err
    assert main([*words, out, '--html', str(tmp_path / 'page.html')]) == 0
    assert 'the calibrated model explains' in capsys.readouterr().out
    assert main(['diagnose', bag, '--model', out, '--effects', 'sensor_gain', '--no-pairs']) == 0
    assert 'WITHIN_FLOOR' in capsys.readouterr().out
    assert main(['model', out]) == 0
    assert 'calibrated on healthy' in capsys.readouterr().out


def test_an_exact_model_cannot_be_calibrated():
    """One sentence that says what to give."""
    with pytest.raises(ValueError, match='uncertainty_frequency'):
        calibrate(shear_building(), [record(1)])
