"""What a candidate's freedom costs, and the share of the gap that it closes."""
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate, priors_of
from ssi_ros.gap.comparison import GapStatistic
from ssi_ros.gap.inference.goodness_of_fit import distance_of, floor_of_band, Gap
from ssi_ros.gap.selection.cross_validation import reduction
from ssi_ros.gap.selection.evidence import (
    beside_law, log_prior_ratio, posterior, Ranked, size_factor)
from ssi_ros.gap.settings import DiagnosisSettings


def occam(of, covariance):
    """Return the log of posterior over prior volume of a candidate."""
    return log_prior_ratio(priors_of(of), covariance)


def candidate(*names, odds=0.0):
    """Return what stands for a candidate."""
    return SimpleNamespace(names=names, odds_in_time=odds)


def test_a_size_that_is_not_seen_is_less_likely_than_none():
    """A hinge that rubs unseen must not tie with the plain hinge that it is then, eq. (112)."""
    plain = Candidate((parse_effect('hinge_compliance:stiffness_n_m_rad=1e5'),))
    rubs = Candidate((parse_effect('hinge_friction:torque_n_m=0.01,stiffness_n_m_rad=1e5'),))
    seen, unseen = 0.01 ** 2, 100.0 ** 2
    assert [f.name for _, f in rubs.numbers()] == ['torque_n_m', 'stiffness_n_m_rad']
    cost = occam(rubs, np.diag([unseen, seen])) - occam(plain, np.diag([seen]))
    # a fifth of sizes is not seen; the stiffness, no size there, has a narrower prior
    assert cost < np.log(0.3)


def test_play_that_hardly_shows_does_not_tie_with_a_plain_hinge():
    """A logarithm known to 1.5 is a size of 0.7 deviations: most likely chance, eq. (112)."""
    plain = Candidate((parse_effect('hinge_compliance:stiffness_n_m_rad=1e6'),))
    play = Candidate((parse_effect('hinge_freeplay:gap_rad=4e-8,stiffness_n_m_rad=1e6'),))
    costs = [occam(play, np.diag([s ** 2, 0.01])) - occam(plain, np.diag([0.01]))
             for s in (1.5, 0.125)]
    # the best fit of noise gains half of a squared deviation; twice as likely counts as a tie
    assert costs[0] + (1 / 1.5) ** 2 / 2 < -np.log(2)
    # what is clearly seen pays for its range only: e to the sixth, known to an eighth
    assert costs[1] == pytest.approx(np.log(np.sqrt(2 * np.pi) / 6 / 8), abs=0.05)


def test_the_likelihood_of_a_size_over_its_prior():
    """A fifth where nothing is seen, a narrow Gaussian where much is, and no step between."""
    assert size_factor(0.0, True) == pytest.approx(0.2, rel=0.08)       # as (113a) has it
    assert size_factor(0.0, False) == size_factor(0.0, True)
    # a power of 2 makes every factor of a size two of deviations: its range is as long
    assert size_factor(0.0, True, 2.0) == pytest.approx(0.2, rel=0.08)
    # the mean of 1 / d over a Gaussian about 10 is 1 % above 1 / 10
    for power in (1.0, 2.0):
        assert size_factor(9.99, True, power) == pytest.approx(
            size_factor(10.01, True, power), rel=0.02)
    assert size_factor(-10.01, False) == pytest.approx(size_factor(9.99, False), rel=0.02)
    assert size_factor(-3.0, True) < 1e-3 < size_factor(-3.0, False)    # a wrong sign is no size


@pytest.mark.parametrize('p_value, low, high', [
    (0.05, 0.3, 0.6), (0.03, 0.4, 0.7), (1e-3, 0.9, 0.995), (1e-12, 0.98, 0.995)])
def test_something_unknown_is_as_probable_as_the_p_value_says(p_value, low, high):
    """Chance is not excluded by p = 0.05, and nothing is ever certain, (113c) and (113d)."""
    null = Ranked(SimpleNamespace(log_likelihood=-1e4))
    _, none, unknown = posterior((), null, 1.0, p_value, 30, DiagnosisSettings())
    assert low < unknown < high
    assert none + unknown == pytest.approx(1.0)


def test_a_law_may_be_off_by_a_tenth_of_what_it_explains():
    """Five deviations beside ten stay; beside a hundred they are what a law leaves, (113e)."""
    p_value = 2 * norm.sf(5.0)
    assert beside_law(p_value, 0.0) == pytest.approx(p_value)
    assert beside_law(p_value, 10.0 ** 2 / 2) < 1e-3
    assert beside_law(p_value, 100.0 ** 2 / 2) > 0.5
    assert beside_law(0.0, 1e9) == 0.0      # how small it is no number says

    floor = GapStatistic(0.2, 0.1, 0.01), GapStatistic(0.2, 0.1, 0.01)
    assert not Ranked(None, held_out=floor, removed=1.0).inside
    assert Ranked(None, held_out=floor, removed=9.0).inside


@pytest.mark.parametrize('explained, ratio', [(0.0, np.exp(-15)), (200.0, np.exp(-3))])
def test_laws_are_not_compared_as_if_they_were_exact(explained, ratio):
    """Of an effect of 20 deviations a tenth is two: 15 nats then say as much as 3, (113e)."""
    settings = DiagnosisSettings()
    fits = [SimpleNamespace(log_likelihood=v, candidate=candidate(n))
            for v, n in ((200.0, 'one'), (185.0, 'other'))]
    shares, *_ = posterior([Ranked(f, explained=explained) for f in fits],
                           Ranked(SimpleNamespace(log_likelihood=0.0)), 1.0, 1.0, 30, settings)
    assert shares[1] / shares[0] == pytest.approx(ratio, rel=0.02, abs=1e-3)   # and (113d)


@pytest.mark.parametrize('best, other, odds, named', [
    (11936.0, 10917.0, -30.0, 1), (477.0, 500.0, 30.0, 0)])
def test_what_moves_through_a_record_or_does_not_counts_in_full(best, other, odds, named):
    """A drift wins by what a detector sees of it, and not by fitting a little better, (113e)."""
    fits = [SimpleNamespace(log_likelihood=v, candidate=candidate(n, odds=o)) for v, n, o in (
        (best, 'stiffness_drift', odds), (other, 'stiffness_scale', 0.0))]
    shares, *_ = posterior(
        [Ranked(f, bonus=f.candidate.odds_in_time, explained=f.log_likelihood) for f in fits],
        Ranked(SimpleNamespace(log_likelihood=0.0)), 1.0, 1.0, 30, DiagnosisSettings())
    assert shares.min() < 0.01 < 0.7 < shares.max() and np.argmax(shares) == named


@pytest.mark.parametrize('count', [1, 4])
def test_a_residual_leaves_the_nearest_effects_a_share(count):
    """Of known effects a share leaves as much, however improbable it is, (113f)."""
    fits = [SimpleNamespace(log_likelihood=100.0, candidate=candidate(f'e{i}'))
            for i in range(count)]
    shares, _, unknown = posterior([Ranked(f) for f in fits],
                                   Ranked(SimpleNamespace(log_likelihood=0.0)), 1e-200, 1.0, 30,
                                   DiagnosisSettings())
    assert 0.85 < unknown < 0.92 and shares.sum() > 0.05


def test_a_second_effect_is_weighed_by_what_it_adds():
    """Beside a nutation of a hundred deviations, lost samples that are sure stay sure."""
    found = [Ranked(SimpleNamespace(log_likelihood=v, candidate=candidate(*n)),
                    explained=v) for v, n in (
        (5000.0, ('one',)), (5150.0, ('one', 'two')), (5100.0, ('one', 'three')))]
    shares, *_ = posterior(found, Ranked(SimpleNamespace(log_likelihood=0.0)), 1.0, 1.0, 30,
                           DiagnosisSettings())
    assert shares[1] > 0.6 and shares[2] < 0.01


@pytest.mark.parametrize('p_value, least, most', [(0.9, 0.6, 0.75), (0.1, 0.3, 0.5),
                                                  (0.01, 0.1, 0.25)])
def test_two_effects_are_as_rare_as_something_unknown(p_value, least, most):
    """The priors are 0.12 and 0.13; one effect of the two may have left what the other takes."""
    settings = DiagnosisSettings()

    def answer(names):
        found = [Ranked(SimpleNamespace(log_likelihood=v, candidate=candidate(*n)), explained=v)
                 for v, n in ((200.0, names), (20.0, ('one',)))]
        null = Ranked(SimpleNamespace(log_likelihood=0.0))
        return posterior(found, null, p_value, 1.0, 30, settings)
    (pair, one), _, unknown = answer(('one', 'two'))
    assert least < pair < most and 0.1 < one / pair < 0.15
    (alone, _), _, other = answer(('three',))
    assert unknown / pair > 1.3 * other / alone


def test_a_hidden_second_effect_has_the_odds_of_the_priors():
    """Draw singles and pairs of which half of the effects stay undetected, and count, (113b)."""
    rng, settings, draws = np.random.default_rng(5), DiagnosisSettings(), 200_000
    both = rng.random(draws) < settings.prior_pair / (settings.prior_pair + settings.prior_single)
    seen = rng.random((draws, 2)) < 0.5
    one = np.where(both, seen.sum(axis=1) == 1, seen[:, 0])
    hidden = np.count_nonzero(one & both) / np.count_nonzero(one & ~both)
    fit = SimpleNamespace(log_likelihood=200.0, candidate=candidate('one'))
    (named,), _, unknown = posterior([Ranked(fit, explained=200.0)], Ranked(
        SimpleNamespace(log_likelihood=0.0)), 1.0, 1.0, 30, settings)
    nothing = 0.15 * settings.prior_unknown / settings.prior_single     # of p = 1, (113)
    assert unknown / named == pytest.approx(hidden + nothing, abs=0.02)


@pytest.mark.parametrize('fitted, true_share', [(1.0, 1.0), (0.5, None)])
def test_the_interval_of_the_closed_share_covers_it(fitted, true_share):
    """A gap in few of many bands, as a line makes it, is no reason for a wide interval, (113)."""
    rng, count, n, d = np.random.default_rng(3), 100, 30, 4
    change = np.zeros((count, d))
    change[40:44] = 1.0
    left = (1 + change) / (1 + fitted * change)
    if true_share is None:
        true_share = 1 - np.sum(left - np.log(left) - 1) / np.sum(change - np.log1p(change))
    covered = []
    for _ in range(200):
        folds = [rng.normal(size=(2, count, d, n)) for _ in range(2)]
        folds = [(f[0] + 1j * f[1]) / np.sqrt(2) for f in folds]
        before, after = (Ranked(None, held_out=tuple(gap_of(f * np.sqrt(s)[..., None])
                                                     for f in folds))
                         for s in (1 + change, left))
        share, low, high = reduction(before, after)
        assert low <= share <= high < 5
        covered.append(low <= true_share <= high)
    assert 0.84 <= np.mean(covered) <= 0.96


def gap_of(spectra):
    """Return the gap of whitened spectra, shape (b, l, n)."""
    white = spectra @ spectra.conj().swapaxes(-1, -2) / spectra.shape[-1]
    distance = distance_of(white[None], 1)[0]
    floor, spread = floor_of_band(spectra.shape[-1], spectra.shape[1])
    return Gap(distance.mean(), floor, spread / np.sqrt(len(white)), distance - floor,
               np.arange(len(white) + 1.0), white, spectra.shape[-1])
