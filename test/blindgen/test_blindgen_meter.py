"""The generator's gap meter, true places, sizes of rare effects, and the baselines."""
from blindgen import baselines, record, whittle
from blindgen.answers import Answer
from blindgen.detect import NOMINAL
from blindgen.effects import EFFECTS
from blindgen.features import features
from blindgen.places import places
from blindgen.plan import nuisances
from blindgen.record import simulate
from blindgen.sparse import pulses, searched, spikes
from blindgen.where import where
import numpy as np
import pytest


def test_a_nominal_record_has_no_gap_against_its_own_model():
    """
    Over 600 s the whitened spectrum is white in every half hertz, at nominal levels.

    A band of 300 bins and four channels has trace 4 +- 0.12 under the taper: the largest of 99
    is within 4.5 sd; their mean, 4 +- 0.012, within 4 sd. Leakage would show in the first bands.
    """
    what = whittle.whitened_bands(simulate(NOMINAL, 600.0, 3)[0])
    trace = np.einsum('bii->b', what).real
    assert len(trace) == 99
    assert np.abs(trace - 4).max() < 4.5 * 0.12 and abs(trace.mean() - 4) < 4 * 0.012


@pytest.mark.parametrize('name, parameters, seconds', [
    ('sensor_gain', {'channel': 'e2_a', 'scale': 1.2}, 60.0),
    ('array_asymmetry', {'array': 'E1', 'scale': 0.8}, 60.0)])
def test_the_true_effect_closes_its_own_gap(monkeypatch, name, parameters, seconds):
    """At its true size an effect leaves the floor: 1 within 0.1, what the floor of a minute is."""
    monkeypatch.setattr(whittle, 'RECORDS', 4)
    monkeypatch.setattr(whittle, 'BAND_BINS', 60)
    whittle.floor.cache_clear()
    whittle.expected.cache_clear()
    scenario = EFFECTS[name].apply(nuisances(5), parameters)
    label = {'effects': [{'name': name, 'parameters': parameters}]}
    told = whittle.closed_by_truth(*simulate(scenario, seconds, 5), label, seconds)
    whittle.floor.cache_clear()
    assert told['before'] > told['floor'] + 3 * told['floor_std']
    assert told['closed'] == pytest.approx(1.0, abs=0.1)


def test_a_pulse_that_must_be_looked_for():
    """
    Certain events count as a shift does, weak ones only raise the level.

    One pulse of 8 sd in 60000 samples has, by the divergence, 8^2 / 2 - ln(2 * 60000) + ... = 20
    nats in favour: d' is 4.6 within a tenth. 200 pulses of 0.3 sd, d' = 4 if told, are nothing.
    """
    assert pulses(8.0, 1 / 60000, 60000) == pytest.approx(4.6, rel=0.1)
    assert pulses(0.3, 200 / 60000, 60000) < 0.01
    assert spikes(0.1, 200 / 60000, 60000) < 0.05 < 4 < spikes(8.0, 10 / 60000, 60000)
    # a line at the threshold of 30000 cells has the power of d' = 1.645: one half
    assert searched(np.sqrt(2 * np.log(30000 / 0.05)), 30000) == pytest.approx(1.645)


def test_where_an_effect_shows():
    """A gain has its channel, a sine its band, a drift its end, a loss no place."""
    gain = where('sensor_gain', {'channel': 'e2_a', 'scale': 1.01}, 60.0, 1)
    assert (gain['channels'], gain['arrays'], gain['times']) == (['e2_a'], ['E2'], [])
    assert sum(gain['bands']) == pytest.approx(1.0, abs=0.01)       # rounding of 100 shares
    sine = where('harmonic_disturbance',
                 {'frequency_hz': 7.2, 'torque_n_m': 0.1, 'phase_rad': 0.0}, 60.0, 1)
    assert sine['bands'][14] > 0.9
    drift = where('stiffness_drift', {'change': 0.01}, 120.0, 1)['times']
    assert sum(drift[10:]) > 0.8                     # a square of time has 7/8 in its second half
    assert where('dropped_samples', {'fraction': 0.01}, 60.0, 1)['bands'] == []


def test_places_are_judged_by_what_they_hold():
    """The band named first must hold half of the best; a place that is not told is not judged."""
    label = {'effects': [{'where': {'site': 'sensor', 'channels': ['e1_b'], 'arrays': ['E1'],
                                    'bands': 50 * [0.02] + 50 * [0.0], 'modes': [], 'times': []}}]}
    told = Answer('EXPLAINED', values={'sensor_gain.channel': 'e1_b'}, site='structure',
                  sensors=(('e2_a', 1.0),), bands=((0.1, 25.0, 0.3), (25.0, 50.0, 0.7)))
    assert places(label, told, 600.0) == {
        'sensor': (True, 0.25), 'side': (True, 0.5), 'site': (False, 0.25), 'band': (False, 0.5)}


def test_baselines_learn_and_their_nulls_are_quiet(monkeypatch):
    """
    Three strong effects and none, in records of 30 s: the forest names 9 of 16 and more.

    Chance would do that in 0.7 % of all cases. The two-sample test sees half of the 12 effects, by
    false alarms of one in eight in 0.3 %; of 4 records without one the tests alarm on two at most.
    """
    names, sizes = ('sensor_gain', 'sensor_noise', 'excitation_colour'), (0.5, 4.0, 0.1)
    monkeypatch.setattr(whittle, 'BAND_BINS', 30)
    monkeypatch.setattr(record, 'SETTLE_S', 10.0)
    monkeypatch.setattr(record, 'LEAD_S', 5.0)
    whittle.expected.cache_clear()

    def example(name, size, seed):
        scenario = nuisances(seed)
        if name != 'none':
            rng = np.random.default_rng(seed)
            effect = EFFECTS[name]
            scenario = effect.apply(scenario, effect.size(effect.draw(rng), size))
        return features(*simulate(scenario, 30.0, seed), 30.0)

    def batch(first, each):
        labels = np.repeat([*names, 'none'], each)
        seen = [example(n, dict(zip(names, sizes)).get(n), first + k)
                for k, n in enumerate(labels)]
        return labels, {kind: np.array([s[kind] for s in seen]) for kind in seen[0]}

    labels, old = batch(100, 8)
    truths, new = batch(900, 4)
    whittle.expected.cache_clear()
    forest = baselines.random_forest(labels, old, new)
    right = [a.effects == ({n} - {'none'}) for a, n in zip(forest, truths)]
    assert sum(right) >= 9
    test = baselines.two_sample(labels, old, new)
    assert sum(a.outcome == 'UNEXPLAINED' for a, n in zip(test, truths) if n != 'none') >= 6
    for told in (test, baselines.shift_table(labels, old, new)):
        assert sum(a.outcome != 'WITHIN_FLOOR' for a, n in zip(told, truths) if n == 'none') <= 2
