"""A calibrated model whose slowest damping came out far off: where its spectrum is not linear."""
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.effects import applicable, inject, simulate_setup
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.whittle import BLAS, whiten
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.model_answer import fit_of
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import load_spacecraft
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.updating.model_uncertainty import ModelUncertainty
from ssi_ros.updating.prior import relinearised, stand

SECONDS = 600.0
OFF = 0.8               # logarithm of the damping, of which 0.25 is the deviation


@pytest.fixture(scope='module')
def comparison():
    """Return a healthy record beside a model that has far too much of one damping."""
    model = load_spacecraft()
    names, stds = declared(model)
    values, stds = np.zeros(len(names)), 0.1 * stds
    slowest = names.index('damping E1 1')
    values[slowest], stds[slowest] = OFF, 0.25
    calibrated = replace(model, calibration=Calibration(names, values, np.diag(stds ** 2)))
    samples = simulate_setup(inject(model, (), SECONDS), 8)
    with BLAS.limit(limits=1):
        return ModelNominal(calibrated).compare(
            samples, DiagnosisSettings(), applicable(model), lambda share: None)


@pytest.mark.slow
def test_errors_move_to_where_the_record_has_them(comparison):
    """Towards the damping of the record, by deviations that the prior counts, step after step."""
    at = comparison.simulator.spacecraft.calibration.names.index('damping E1 1')
    before = comparison.here
    moved = relinearised(before, whiten(comparison.null.state.plain, comparison.record.spectra))
    assert moved is not None
    for _ in range(3):
        side, prior = moved
        value = side.spacecraft.calibration.values[at]
        assert value < before.simulator.spacecraft.calibration.values[at]
        shift = np.array(side.spacecraft.calibration.values) - np.array(
            comparison.simulator.spacecraft.calibration.values)
        assert prior.root @ prior.offset == pytest.approx(shift, abs=1e-9)
        before = stand(side, prior, comparison.null.levels, comparison.settings)
        found = fit(side, comparison.record.spectra, levels=comparison.null.levels,
                    uncertainty=before.uncertainty)
        moved = relinearised(before, whiten(found.plain, comparison.record.spectra))
        if moved is None:
            break
    # 600 s tell the logarithm of that damping to 0.4, the prior to 0.25: the mean of both is 0.57
    assert moved is None and abs(value) < 0.7 * OFF


@pytest.mark.slow
def test_simulated_records_are_of_the_model_where_it_stands(comparison):
    """Errors that a record moved by four deviations each are no evidence in its own floor."""
    prior, moved = comparison.here.prior, copy(comparison)
    off = np.array([4.0 * n.startswith('frequency') for n in prior.names])
    moved.here = stand(comparison.simulator, replace(prior, offset=off), comparison.null.levels,
                       comparison.settings)
    moved.null = fit_of(fit(comparison.simulator, comparison.record.spectra,
                            levels=comparison.null.levels,
                            uncertainty=moved.here.uncertainty), moved.here)
    moved._made = {}
    # means of five, of deviation 0.45 each
    assert np.sqrt(np.mean(moved.simulated_floor(moved.null).z ** 2)) < 0.7


def test_directions_of_errors_keep_their_offset_beside_others():
    """Gains, then errors of numbers, then heights: of each what was there."""
    one = ModelUncertainty(('gain',), np.eye(1, 3))
    two = ModelUncertainty(('error',), np.eye(1, 3, 1), np.array([2.0]), np.array([[4.0, 5.0]]))
    three = ModelUncertainty(('height',), np.eye(1, 3, 2), np.zeros(1), np.zeros((1, 2)), 1)
    found = one.and_of(two).and_of(three)
    assert found.names == ('gain', 'error', 'height') and found.heights == 1
    assert np.array_equal(found.offset, [0.0, 2.0, 0.0])
    assert np.array_equal(found.into, [[0.0, 0.0], [4.0, 5.0], [0.0, 0.0]])
