"""Heights of slow modes beside errors of the model: what the likelihood of both promises."""
from craft import model, record, SECONDS
import numpy as np
import pytest
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import _Place, _Problem
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.updating.adapt import standing
from ssi_ros.updating.correlation import heights_of
from ssi_ros.updating.prior import error_directions, prior_of

STEP = 0.02     # of the logarithm of a level


def place(spacecraft, samples, levels):
    """Return where a fit of levels stands beside errors and heights."""
    frame = make_frame(len(samples.values), spacecraft.rate_hz, DiagnosisSettings())
    prior = prior_of(spacecraft)
    simulator = standing(Simulator(spacecraft, frame, SECONDS), prior)
    free = error_directions(simulator, levels, prior).and_of(
        heights_of(simulator, Candidate(), levels, len(prior.names)))
    assert len(free.heights)
    problem = _Problem(simulator, simulator.evidence(samples), free)
    return _Place(problem, Candidate(), simulator.expected(Candidate(), levels), np.log(levels),
                  None)


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_slopes_are_those_of_the_likelihood_beside_both(seed):
    """Heights that are fitted without the errors alone promise what no step can give."""
    here = place(model(), record(seed), np.array([1.1, 1.2, 0.95]))
    for _ in range(3):      # errors go on where they stand: so far off, one search is not enough
        here = here.at(here.x)
    score, information = here.gradient()
    found = [(here.at(here.x + s).value - here.at(here.x - s).value) / (2 * STEP)
             for s in STEP * np.eye(len(here.x))]
    assert score == pytest.approx(found, abs=0.3 * np.sqrt(np.diag(information)).max())
