"""Where a gap lies, told by the effect that explains it, is where the true effect changes most."""
from dataclasses import replace

from gap_records import evidence_of, record, SETTINGS
import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.goodness_of_fit import distance_of, whitened
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.nominal.model_location import change, measured
from ssi_ros.gap.selection.localisation import locate
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT


@pytest.mark.parametrize('text', ['array_asymmetry:array=E2,scale=0.998',
                                  'sensor_crosstalk:source=e2_a,channel=e1_a,gain=0.008'])
def test_bands_of_a_small_gap_are_those_of_the_truth(text):
    """A gap of few deviations is noise in most bands; the fitted effect has none."""
    effect = parse_effect(text)
    samples, simulator = record(300.0, [effect])
    evidence = evidence_of(simulator, samples)
    nominal = fit(simulator, evidence)
    fitted = fit(simulator, evidence, Candidate((effect,)), nominal.levels)
    truth = simulator.expected(Candidate((effect,))).at(np.ones(3))
    right = simulator.expected(Candidate()).at(np.ones(3))
    true = distance_of(whitened(right, truth), SETTINGS.band_bins)[0]
    true = np.array([b.sum() for b in np.array_split(true, 12)]) / true.sum()

    def off(told):
        bands = located(simulator, nominal.model, evidence, told).bands
        return np.abs(np.array([b['share'] for b in bands]) - true).sum()

    # half the sum of differences of shares is what lies in a wrong band
    assert off(fitted.model) / 2 < 0.15
    assert off(fitted.model) < 0.7 * off(None)


def located(simulator, model, evidence, fitted=None):
    """Return where the gap lies, by what a certain effect changes if one is given."""
    bins = SETTINGS.band_bins
    system = simulator.setup(Candidate()).system
    changed = None if fitted is None else change((model, fitted), evidence, bins, (), 1.0)
    return locate(measured(system, model, evidence, bins), changed)


def test_times_of_a_swing_are_its_own():
    """A level that swings is wrong at crests and troughs, and right between."""
    effect = parse_effect('nonstationary_excitation:depth=0.3,period_s=240')
    samples, simulator = record(240.0, [effect])
    evidence = evidence_of(simulator, samples)
    nominal = fit(simulator, evidence)
    fitted = fit(simulator, evidence, Candidate((effect,)), nominal.levels)
    times = located(simulator, nominal.model, evidence, fitted.model).times
    middles = np.array([(t['start_s'] + t['end_s']) / 2 for t in times])
    swing = np.sin(2 * np.pi * middles / 240.0)
    shares = np.array([t['share'] for t in times])
    assert shares.sum() == pytest.approx(1.0)
    assert np.corrcoef(shares, swing ** 2)[0, 1] > 0.7


@pytest.mark.slow
@pytest.mark.parametrize('text', ['impulsive_events:rate_per_min=2,impulse_n_m_s=0.08',
                                  'saturation:limit_m_s2=0.12'])
def test_times_of_single_events_are_theirs(text):
    """Pulses and rails hit some pieces and not others: the spectrum hardly tells which."""
    effect = parse_effect(text)
    samples, _ = record(600.0, [effect], seed=4)
    quiet, _ = record(600.0, [], seed=4)
    there = np.abs(samples.values - quiet.values).max(axis=1)
    # a pulse rings on: where what it adds rises at once it begins
    begins = (there > 0) if 'saturation' in text else (
        np.append(0.0, np.diff(there)) > 0.5 * there.max())
    found = diagnose(replace(load_spacecraft(), uncertainty=EXACT), samples, pairs=False)
    assert found.verdict['effects'] == (effect.name,)
    times = found.where.times
    span = len(there) // len(times)
    true = np.add.reduceat(begins, np.arange(len(times)) * span).astype(float)
    shares = np.array([t['share'] for t in times])
    assert np.corrcoef(shares, true)[0, 1] > 0.8
