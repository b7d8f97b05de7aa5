"""Scores beside fitted errors of a model see what a likelihood ratio sees."""
from dataclasses import replace

from craft import model, record, twin
import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import make_templates, promise, score
from ssi_ros.gap.inference.whittle import BLAS
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model.errors import Calibration, declared, of_recording
from ssi_ros.model.uncertainty import Uncertainty
from ssi_ros.updating.adapt import standing
from ssi_ros.updating.prior import error_directions, known_by_recordings, prior_of, stand

SETTINGS = DiagnosisSettings()


@pytest.mark.parametrize('text', ['hub_inertia:scale=0.94', 'clock_rate:ppm=-3000'])
def test_a_score_beside_errors_is_near_the_likelihood_ratio(text):
    """Errors that do nearly the same, and forces on modes 3 dB off, take what is theirs."""
    names, stds = declared(twin())
    known = np.where(of_recording(names), stds, 0.1 * stds)
    calibrated = replace(twin(), calibration=Calibration(
        names, twin().calibration.values, np.diag(known ** 2)))
    effect = parse_effect(text)
    with BLAS.limit(limits=1):
        _, simulator, made_ready, levels = ModelNominal(calibrated).ready(
            record(11, text, forces_db=3.0), SETTINGS)
        here = stand(simulator, known_by_recordings(calibrated.calibration), levels, SETTINGS)
        evidence = made_ready.spectra
        null, full = (fit(simulator, evidence, c, levels, uncertainty=here.uncertainty)
                      for c in (Candidate(), Candidate((effect,))))
        templates = make_templates(simulator.for_templates(levels), [effect])
        z = score(templates, null, evidence, here.uncertainty).z[0]
    gain = full.likelihood - null.likelihood
    assert gain > 8.0
    assert z == pytest.approx(np.sqrt(2 * gain), rel=0.25)


def test_scores_beside_declared_errors_are_of_first_order():
    """Errors of several per cent leave little of a derivative, and as much of both signs."""
    craft = replace(model(), uncertainty=Uncertainty(
        frequency=0.03, participation=0.09, shape=0.09, hub_inertia=0.06))
    side = standing(Simulator(craft, make_frame(60_000, 100.0, SETTINGS), 600.0), prior_of(craft))
    expected = side.expected(Candidate())
    errors = error_directions(side, np.ones(len(expected.names)), prior_of(craft))
    effects = [parse_effect(f'hub_inertia:scale={s}') for s in (0.98, 1.02)]
    less, more = promise(make_templates(side, effects), expected, side.frame, errors)[0]
    assert less == pytest.approx(more, rel=0.01)
    assert less < 2.0           # 0.5 and 84 where the square of 2 % counts
