"""Two recordings of one signal that repeats itself: period, clock, line, sweep, swing, phase."""
from dataclasses import replace

import numpy as np
import pytest
from reference_records import chain, diagnose_reference, PERIOD, RATE_HZ, shaken
from ssi_ros.effects import applicable, effect_class
from ssi_ros.effects.registry import detectors
from ssi_ros.gap.nominal.modal.amplitude_dependence import amplitude_dependence, significance
from ssi_ros.gap.nominal.modal.reference import make_nominal
from ssi_ros.gap.nominal.pairing import make_pair
from ssi_ros.gap.nominal.periodic.detections import both_repeat, clock_error, in_phase
from ssi_ros.gap.nominal.periodic.modulation import common_sine, gains_of
from ssi_ros.gap.nominal.periodic.period import period_of
from ssi_ros.gap.nominal.periodic.random_walk import independent_share
from ssi_ros.gap.nominal.periodic.repeats import (
    at_instants, delay_between, Repeats, repeats_of, turned)
from ssi_ros.gap.nominal.recordings import prepare
from ssi_ros.gap.spectra.band_averages import plan, spectra_of


def split(samples):
    return repeats_of(samples.values, samples.rate_hz, PERIOD)


def detected(one, two):
    """Return {effect: Detection} of what the periods of two recordings show."""
    recordings = prepare(one, two, applicable(None))
    found = [f(effect_class(n), recordings) for n, f in detectors('periods').items()]
    return {d.effect: d for d in found if d is not None}


def line(t):
    return 0.03 * np.sqrt(2) * np.sin(2 * np.pi * 4.317 * t)


def sweep(t):
    return 0.1 * np.sqrt(2) * np.sin(2 * np.pi * (2.0 * t + (9.0 - 2.0) * t ** 2 / (2 * t[-1])))


@pytest.mark.parametrize('change, words', [
    ([[1, 0, 0], [0, -1, 0], [0, 0, 1]], 'the polarity of b is reversed'),
    ([[0, 1, 0], [1, 0, 0], [0, 0, 1]], 'channels a and b are swapped')])
def test_wiring_is_named_under_a_drive_that_repeats(change, words):
    """Under other phases of the drive and half of its level, before any effect is tried."""
    healthy, record = shaken(41), shaken(42, draw=1)
    found = diagnose_reference(healthy, replace(record, values=record.values @ change / 2))
    assert found.outcome == 'UNEXPLAINED' and words in found.reason
    assert found.where.site['sensor'] == 1.0


def test_values_between_samples_are_those_of_the_wave():
    """A sine at four fifths of half of the rate: 1e-4 of it, far from the ends."""
    rows = np.arange(100, 900) + 0.37
    wave = np.sin(0.8 * np.pi * np.arange(1000))[:, None]
    assert np.allclose(at_instants(wave, rows)[:, 0], np.sin(0.8 * np.pi * rows), atol=1e-4)


@pytest.mark.parametrize('ppm', [0.0, 137.0, -2500.0, 20_000.0])
def test_the_period_is_told_to_a_few_millionths(ppm):
    """Half a whole period, begun anywhere; a clock that is fast sees fewer rows."""
    found = split(shaken(1, 5.5, begin=333.3, ppm=ppm))
    # 2e-6 of a period: noise of 0.3 % on hundreds of lines leaves less
    assert found.period_rows == pytest.approx(PERIOD / (1 + 1e-6 * ppm), rel=2e-6)
    assert found.periods.shape == (5, PERIOD, 3)
    assert found.share > 0.999


def test_two_periods_of_no_whole_number_of_rows_are_no_clock():
    """0.4 rows beyond a whole number: the lines that it turns most tell it as well as others."""
    samples = shaken(32, 2.3, ppm=-400.0)
    # 2e-5 of a period: two of them, noise of 0.3 %
    assert split(samples).period_rows == pytest.approx(PERIOD * 1.0004, rel=2e-5)
    assert clock_error(split(samples), split(shaken(33, 2.3, ppm=-400.0, begin=100.0))) is None


def test_a_structure_that_drifts_does_not_change_the_period():
    """2 % of stiffness over the record turn the lines at the modes; most lines stay."""
    assert split(shaken(2, scale=(1.0, 0.98))).period_rows == pytest.approx(PERIOD, rel=2e-5)


def test_what_does_not_repeat_has_no_periods():
    """Noise, and a recording of less than two periods."""
    assert split(chain(3)) is None
    assert split(shaken(4, 1.9)) is None
    pair = make_pair(chain(5), chain(6))
    assert both_repeat(pair, period_of(pair.reference)) is None
    assert in_phase(pair, None) is pair


def test_the_mean_period_turns_onto_that_of_another_beginning():
    """Begun 123.4 rows earlier in the signal, the record is late by as much."""
    one, two = split(shaken(7, begin=500.0)), split(shaken(8, begin=500.0 - 123.4))
    delay, alike = delay_between(one, two)
    assert delay == pytest.approx(123.4, abs=0.01)
    assert alike > 0.999
    # what is left is the noise of both means, 0.3 % of the rms over the root of 6 periods
    assert np.abs(turned(one, delay) - two.mean).std() < 0.003 * two.mean.std()


def test_recordings_begun_out_of_phase_have_no_gap():
    """Segments hold other parts of the signal unless both begin at the same row of it."""
    one, two = shaken(9), shaken(10, begin=377.0)
    pair = make_pair(one, two)
    after = in_phase(pair, both_repeat(pair, PERIOD))
    assert np.corrcoef(after.reference[:PERIOD, 0], after.record[:PERIOD, 0])[0, 1] > 0.999
    assert diagnose_reference(one, two).outcome == 'WITHIN_FLOOR'


def test_nothing_is_told_where_nothing_is():
    """Another stretch of the same; less stiffness; stiffness that drifts; losses of a mode."""
    one = shaken(11)
    for two in (shaken(12, begin=77.0), shaken(13, scale=(0.98, 0.98)),
                shaken(14, scale=(1.0, 0.98))):
        assert detected(one, two) == {}


def test_a_clock_is_told_from_stiffness():
    """1 % of frequency from either: the period parts them."""
    one = shaken(15)
    found = diagnose_reference(one, shaken(16, ppm=-10_000.0))
    assert found.verdict['class'] == ('clock_rate',)
    assert found.candidates[0].parameters['clock_rate.ppm'].value == pytest.approx(-1e4, rel=1e-3)
    found = diagnose_reference(one, shaken(17, scale=(0.98, 0.98)))
    assert found.candidates[0].effects == ('stiffness_scale',)


def test_two_good_clocks_are_no_gap():
    """20 ppm part any two crystals."""
    assert clock_error(split(shaken(18)), split(shaken(19, ppm=20.0))) is None


def test_a_line_between_the_lines_is_seen_far_below_them():
    """3 % of the rms; a reference that has it as well makes it no difference."""
    found = detected(shaken(20), shaken(21, added=line))
    assert set(found) == {'harmonic_disturbance'}
    # a quarter of a bin of the whole record: the trend takes some of its flanks
    frequency = found['harmonic_disturbance'].parameters['frequency_hz']
    assert frequency == pytest.approx(4.317, abs=0.25 * RATE_HZ / (6 * PERIOD))
    assert detected(shaken(20, added=line), shaken(21, added=line)) == {}
    assert 'harmonic_disturbance' in diagnose_reference(
        shaken(20), shaken(21, added=line)).verdict['class']


def test_a_sweep_is_followed_through_what_does_not_repeat():
    """10 % of the rms from 2 to 9 Hz in 130 s, of which 120 s are whole periods."""
    found = detected(shaken(22, 6.5), shaken(23, 6.5, added=sweep))
    assert set(found) == {'wheel_speed_sweep'}
    numbers = found['wheel_speed_sweep'].parameters
    # a bin of the windows of 692 or 218 rows
    assert numbers['start_hz'] == pytest.approx(2.0, abs=0.25)
    assert numbers['end_hz'] == pytest.approx(9.0, abs=0.25)
    whole = diagnose_reference(shaken(22, 6.5), shaken(23, 6.5, added=sweep))
    assert whole.candidates[0].effects == ('wheel_speed_sweep',)


def test_what_dies_away_is_no_sweep():
    """A start from rest rings for the first seconds only."""
    def start(t):
        return 0.3 * np.exp(-0.15 * t) * np.sin(2 * np.pi * (3.0 + 0.02 * t) * t)
    assert 'wheel_speed_sweep' not in detected(shaken(24), shaken(25, added=start))


def test_what_dies_away_in_every_period_is_no_sweep():
    """A slow line that begins anew with the signal and is not the same each time."""
    def start(t):
        again = np.random.default_rng(34).standard_normal(6)[(t // 20.0).astype(int)]
        return 0.1 * again * np.exp(-0.3 * (t % 20.0)) * np.sin(2 * np.pi * 1.3 * t)
    assert 'wheel_speed_sweep' not in detected(shaken(24), shaken(25, added=start))


@pytest.mark.parametrize('period_s', [31.0, 20.0])
def test_a_swing_of_the_level_is_told_with_its_depth(period_s):
    """10 %, at odds with the signal and in step with it, where only the reference tells."""
    def level(t):
        return 1 + 0.1 * np.sin(2 * np.pi * t / period_s)
    found = detected(shaken(26), shaken(27, begin=250.0, level=level))
    assert set(found) == {'nonstationary_excitation'}
    numbers = found['nonstationary_excitation'].parameters
    assert numbers['depth'] == pytest.approx(0.1, abs=0.01)      # windows smooth it by 3 %
    assert numbers['period_s'] == pytest.approx(period_s, rel=0.02)


def test_bands_that_go_their_own_ways_are_no_swing():
    """Six gains with sines of one size and any phase: no level that all have in common."""
    t = np.arange(48)
    phases = np.random.default_rng(28).uniform(0, 2 * np.pi, 6)
    apart = 0.1 * np.sin(2 * np.pi * t[:, None] / 17.0 + phases)
    assert common_sine(apart)[2] > 1e-2
    together = 0.1 * np.sin(2 * np.pi * t[:, None] / 17.0 + np.ones(6))
    noise = 1e-3 * np.random.default_rng(29).standard_normal(apart.shape)
    assert common_sine(together + noise)[2] < 1e-6
    assert gains_of(split(shaken(30)), split(shaken(30)).mean).shape == (48, 6)


def rattling(walk, seed):
    """Return periods of noise that repeats itself and wanders away, of coherence exp(-walk)."""
    rng = np.random.default_rng(seed)
    periods = [rng.standard_normal((PERIOD, 2))]
    keep = np.exp(-walk)
    for _ in range(5):
        fresh = rng.standard_normal((PERIOD, 2))
        periods.append(keep * periods[-1] + np.sqrt(1 - keep ** 2) * fresh)
    return Repeats(np.array(periods), float(PERIOD), 0.0, RATE_HZ, 6.0)


def test_periods_that_wander_are_fewer_spectra():
    """Copies part nothing, noise is as independent as it looks, what is between is not."""
    cut = plan(6 * PERIOD, RATE_HZ, 2, PERIOD)
    share = {w: independent_share(rattling(w, 31), cut, True).mean() for w in (0.0, 0.15, 20.0)}
    assert share[0.0] == pytest.approx(1.0)         # to round-off: both have the very same
    assert share[20.0] > 0.9
    # 1 + 2 sum (1 - k / 6) exp(-0.3 k) = 3.6 spectra of six are one, and none is in both
    assert share[0.15] == pytest.approx(1 / 3.4, rel=0.25)
    # two periods cannot tell a walk from noise, and are not trusted beyond it
    two = Repeats(rattling(0.5, 31).periods[:2], float(PERIOD), 0.0, RATE_HZ, 2.0)
    assert independent_share(two, cut, True).mean() == pytest.approx(0.8, abs=0.1)
    # under another signal copies are one spectrum
    assert independent_share(rattling(0.0, 31), cut, False).mean() == pytest.approx(1 / 6)


def test_what_the_phases_of_a_signal_make_of_a_slope_is_no_joint():
    """A linear structure seems to depend on its amplitude, in the reference as in the record."""
    one, two = shaken(1, 24, step=3), shaken(2, 24, scale=(0.98, 0.98), step=3)
    cut = plan(len(one.values), RATE_HZ, 3, PERIOD)
    modes = make_nominal(one.values, one.channels, cut,
                         spectra_of(one.values, cut).mean).modes
    own = [amplitude_dependence(s.values, RATE_HZ, modes) for s in (one, two)]
    lines = np.full(len(modes), 10.0)
    beside = own[1].beside(own[0], lines)
    alone, both = (len(modes) * significance(d.frequency_slopes, d.frequency_stds).min()
                   for d in (own[1], beside))
    assert alone < 1e-3 and both > 0.05
    # of one line the amplitude hardly changes, whatever the slope
    assert np.all(np.isinf(own[1].beside(own[0], lines / 10).frequency_stds))
