"""Known shapes of gaps that are not in the library, (105a) to (105c)."""
from dataclasses import replace
from types import SimpleNamespace

from gap_records import evidence_of, record
import numpy as np
import pytest
from scipy.stats import norm
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.effects.edits import add_part
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.unmodelled.scores import score_changes
from ssi_ros.gap.inference.unmodelled.templates import _drifts, make_change_templates
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import assemble, load_spacecraft
from ssi_ros.model.excitation import Coloured, White
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.updating.model_uncertainty import no_uncertainty
from ssi_ros.updating.score_variance import as_gaussian, energies


def exact_spacecraft():
    """Return the packaged spacecraft as a model that is declared exact."""
    return replace(load_spacecraft(), uncertainty=EXACT)


def beside(part):
    """Return the diagnosis of a record with one more part of the excitation."""
    setup = add_part(inject(load_spacecraft(), (), 600.0), part)
    return diagnose(exact_spacecraft(), simulate_setup(setup, 5), DiagnosisSettings(),
                    pairs=False)


@pytest.mark.slow
def test_a_torque_that_is_not_in_the_library_is_told():
    """No effect of the library adds it: the answer is that none explains the record."""
    found = beside(White('other', ('torque_y',), (0.07,)))
    assert found.outcome == 'UNEXPLAINED'
    assert any('random torque about y' in s for s in found.signs)


@pytest.mark.slow
def test_a_slow_torque_beside_one_about_its_axis_is_a_colour():
    """Both together are one torque with more power at low frequencies."""
    found = beside(Coloured(White('other', ('torque_x',), (0.3,)), 0.5))
    assert found.outcome == 'EXPLAINED' and found.verdict['effects'] == ('excitation_colour',)


def test_scores_of_strangers_are_standard_where_the_model_is_right():
    """Each has the mean 0 and the deviation 1, levels projected out; a slow mode's as well."""
    z, changes = [], make_change_templates(record(200.0)[1])
    for seed in range(12):
        samples, simulator = record(200.0, seed=seed)
        evidence = evidence_of(simulator, samples)
        scores = score_changes(changes, fit(simulator, evidence), evidence,
                               no_uncertainty(simulator.frame, 4))
        z.append(scores.z)
    z, texts = np.array(z), [s.text for s in scores.effects]
    assert np.all(np.abs(z.mean(axis=0)) < 3.5 / np.sqrt(len(z)))
    assert 0.8 < np.sqrt(np.mean(z ** 2)) < 1.2
    for number in ('frequency', 'damping'):
        # those of the two arrays go together: 12 of them, three deviations of their rms
        slow = [i for i, text in enumerate(texts) if f'{number} of mode 1 ' in text]
        assert 0.45 < np.sqrt(np.mean(z[:, slow] ** 2)) < 1.6


def test_a_damping_told_by_few_energies_has_their_tail():
    """The mean of three exponentials, standardised: as far out as often as a Gaussian says."""
    mean = np.random.default_rng(2).gamma(3.0, 1 / 3, 200_000)
    z = as_gaussian((mean - 1) * np.sqrt(3), np.full(len(mean), 2 / np.sqrt(3)))
    for far in (1.0, 2.0, 3.0):
        often = norm.sf(far)
        # 10 %: what the cube root of so few is off by
        assert np.mean(z > far) == pytest.approx(often, rel=0.1)
        assert np.mean(z < -far) < often
    same = np.array([-5.0, 5.0])
    assert np.array_equal(as_gaussian(same, np.zeros(2)), same)


def test_a_record_holds_as_many_energies_as_a_mode_forgets():
    """One of a short record, and of a long one as many as times that its amplitude decays."""
    assert energies(1e-4)[0] == pytest.approx(1.0, rel=1e-3)
    count, share = energies(200.0)
    assert count == pytest.approx(200.0, rel=5e-3) and share == pytest.approx(1.0, rel=5e-3)


@pytest.mark.parametrize('freedoms, words', [
    pytest.param(('E2_eta4',), 'another frequency of mode 4 of E2', marks=pytest.mark.slow),
    pytest.param(tuple(f'E1_eta{m}' for m in range(2, 11)), 'single modes differ from the model',
                 marks=pytest.mark.slow)])
def test_modes_that_moved_on_their_own_are_told(freedoms, words):
    """No effect of the library moves one mode of one array, or each by its own amount."""
    setup = inject(load_spacecraft(), (), 600.0)
    stiffness = setup.system.stiffness.copy()
    for k, name in enumerate(freedoms):
        row = setup.system.dofs.index(name)
        stiffness[row, row] *= 1.015 if len(freedoms) == 1 else 1 + 0.006 * (-1) ** k
    moved = replace(setup, system=replace(setup.system, stiffness=stiffness))
    found = diagnose(exact_spacecraft(), simulate_setup(moved, 5),
                     DiagnosisSettings(), pairs=False)
    assert found.outcome == 'UNEXPLAINED'
    assert any(words in s for s in found.signs)


@pytest.mark.slow
@pytest.mark.parametrize('channels, size, words', [
    (slice(1), 0.01, 'the gain of e1_'),
    (slice(2), 0.06, 'the gain of all of E')])
def test_a_gain_that_follows_the_temperature_is_told(channels, size, words):
    """Its mean over the record is that of the model, so that no spectrum shows it."""
    samples = simulate_setup(inject(load_spacecraft(), (), 600.0), 6)
    values = samples.values.copy()
    wave = np.cos(np.pi * np.arange(len(values)) / len(values))
    values[:, channels] *= 1 + size * wave[:, None]
    found = diagnose(exact_spacecraft(), replace(samples, values=values), DiagnosisSettings(),
                     pairs=False)
    assert found.outcome == 'UNEXPLAINED'
    assert any(words in s and 'a drift of' in s for s in found.signs)


@pytest.mark.slow
def test_a_level_that_swings_is_no_wandering_gain():
    """What swings on all channels together is left to the effect of that name."""
    effect = parse_effect('nonstationary_excitation:depth=0.5,period_s=120')
    samples = simulate_setup(inject(load_spacecraft(), (effect,), 600.0), 6)
    found = diagnose(exact_spacecraft(), samples, DiagnosisSettings(), pairs=False)
    assert found.outcome == 'EXPLAINED'
    assert found.verdict['effects'] == ('nonstationary_excitation',)
    assert not any('a drift of' in s for s in found.signs)


def test_modes_that_carry_all_mass_of_an_array_may_still_drift():
    """A calibration may end where 1 % more coupling with the hub has no mass matrix."""
    model, system = load_spacecraft(), assemble(load_spacecraft())
    own = np.array([d.split('_eta')[0] for d in system.dofs])
    between = np.not_equal.outer(own, own)

    def coupled(factor):
        return np.where(between, factor * system.mass, system.mass)
    most = min(f for f in np.geomspace(1, 100, 2000) if np.linalg.eigvalsh(coupled(f))[0] <= 0)
    setup = replace(inject(model), system=replace(system, mass=coupled(most / 1.004)))
    side = SimpleNamespace(setup=lambda candidate: setup, spacecraft=model)
    texts = [change.text for change, _ in _drifts(side)]
    assert sum('coupling' in t for t in texts) == 3
