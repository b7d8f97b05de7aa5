"""What modes correlate: against the exact variance of a score, and against simulated records."""
import numpy as np
import pytest
from ssi_ros.effects import effect_class
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import Directions, make_templates, score
from ssi_ros.gap.inference.unmodelled.templates import constant_templates
from ssi_ros.gap.inference.whittle import whiten
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.nominal.starting_points import starting_points
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.imputation import spectrum
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.integrity.filling import record_of
from ssi_ros.model import load_spacecraft
from ssi_ros.records import Samples
from ssi_ros.updating.adapt import standing
from ssi_ros.updating.correlation import heights_of
from ssi_ros.updating.model_uncertainty import no_uncertainty
from ssi_ros.updating.prior import error_directions, prior_of

SECONDS = 600.0
RECORDS = 40


@pytest.fixture(scope='module')
def side():
    spacecraft = load_spacecraft()
    frame = make_frame(60000, spacecraft.rate_hz, DiagnosisSettings())
    return Simulator(spacecraft, frame, SECONDS)


def lost(simulator, templates):
    """Return by what factor d' of templates around the nominal falls beside heights, (t,)."""
    nominal, frame = simulator.expected(Candidate()), simulator.frame
    model = nominal.at_nominal
    free, heights = (no_uncertainty(frame, model.shape[-1]),
                     heights_of(simulator, Candidate(), np.ones(3), 0))
    alone, beside = (Directions(templates, model, nominal.shares, u, frame, frame.used).spread
                     for u in (free, heights))
    return alone / beside


def test_a_slow_damping_is_known_less_well(side):
    """Of the slowest mode few bins share the height; others know more, so that less is lost."""
    templates = constant_templates(side)
    ratio, scatter = lost(side, templates), np.array([c.scatter for c in templates.effects])
    slow = scatter > 1.2
    assert slow.any() and np.all(ratio[slow] > 1.1)
    assert np.all(ratio > 0.999) and np.all(ratio[slow] < scatter[slow])


def test_the_proportions_of_channels_are_as_sharp_as_before(side):
    """A gain shows in the noise beside a resonance, which no mode correlates."""
    templates = make_templates(side, [effect_class('sensor_gain')(channel='e1_a', scale=1.01)])
    assert lost(side, templates) < 1.01


@pytest.mark.slow
def test_scores_beside_errors_have_the_variance_that_is_promised(side):
    """Of what errors leave of a controller; without correlations its variance is above 2."""
    names = 'attitude_controller', 'sensor_noise'
    effects = starting_points([effect_class(n) for n in names], side.spacecraft)
    templates = make_templates(side, effects)
    prior = prior_of(side.spacecraft)
    draws, plain, found = np.random.default_rng(3), [], []
    root = np.linalg.cholesky(spectrum(side, 2 * 60000, None))
    errors = error_directions(standing(side, prior), np.ones(3), prior)
    heights = heights_of(side, Candidate(), np.ones(3), len(prior.names))
    for _ in range(RECORDS):
        values = record_of(root, draws)[:60000]
        samples = Samples(values - values.mean(axis=0), side.frame.rate_hz, ('',) * 4)
        evidence = side.evidence(samples)
        fitted = fit(side, evidence)
        plain.append(score(templates, fitted, evidence, errors).z)
        found.append(score(templates, fitted, evidence, errors.and_of(heights)).z)
    assert np.var(plain, axis=0).max() > 2.0
    assert np.all(np.var(found, axis=0) > 0.4) and np.var(found, axis=0).max() < 1.5


def test_a_model_raised_by_heights_is_as_likely_as_they_are(side):
    """The raised spectrum has the likelihood that heights give, but for their prior."""
    samples = Samples(record_of(np.linalg.cholesky(spectrum(side, 2 * 60000, None)),
                                np.random.default_rng(5))[:60000], side.frame.rate_hz, ('',) * 4)
    evidence, model = side.evidence(samples), side.expected(Candidate()).at_nominal
    free = heights_of(side, Candidate(), np.ones(3), 0)
    before, raised = whiten(model, evidence), free.raised(model, evidence)
    values = free.heights.most_probable(before)
    after = free.taken_out(before).likelihood + values @ values / 2
    assert whiten(raised, evidence).likelihood == pytest.approx(after, rel=1e-12)
    assert after > before.likelihood
    moved = np.flatnonzero(np.abs(raised / model - 1).max(axis=(0, 2, 3)) > 1e-9)
    assert 0 < len(moved) and set(moved) <= set(free.heights.bins)
