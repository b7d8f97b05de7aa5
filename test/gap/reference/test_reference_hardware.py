"""What measured records bring: periods, copies, bursts, close channels, deep noise."""
import numpy as np
import pytest
from reference_records import chain, diagnose_reference, RATE_HZ
from scipy.signal import lfilter
from ssi_ros.events.prediction_error import predictor
from ssi_ros.gap.nominal.modal.reference import make_nominal
from ssi_ros.gap.nominal.modal.starting_values import all_forms, bracketed
from ssi_ros.gap.nominal.pairing import dithered, make_pair
from ssi_ros.gap.nominal.periodic.period import period_of
from ssi_ros.gap.nominal.periodic.stationarity import steadiness
from ssi_ros.gap.nominal.stationary.level import modulation
from ssi_ros.gap.spectra.band_averages import level_of, plan, spectra_of
from ssi_ros.integrity.values import limit_of
from ssi_ros.records import Samples


def changed(samples, values):
    return Samples(values, samples.rate_hz, samples.channels)


def test_a_signal_played_over_and_over_has_its_period_and_a_resonance_has_none():
    """Noise of 1000 rows repeated; three modes of 1 % forget themselves for good."""
    once = np.random.default_rng(1).standard_normal((1000, 2))
    noise = 0.1 * np.random.default_rng(2).standard_normal((6000, 2))
    assert period_of(np.tile(once, (6, 1)) + noise) == 1000
    assert period_of(chain(3).values) is None


def test_whole_periods_stay_together():
    """Every group of segments holds whole periods, so none differs by where it begins."""
    cut = plan(4400, 50.0, 2, 1000)
    assert cut.rows * cut.together == 1000
    values = np.tile(np.random.default_rng(1).standard_normal((1000, 2)), (5, 1))[:4400]
    groups = spectra_of(values, cut).groups
    assert len(groups) == 4
    # 1e-9: copies of one period differ by round-off only
    assert np.allclose(groups, groups[0], rtol=1e-9)


def test_bursts_are_trusted_less_and_steady_noise_is_not():
    """White noise, and the same with a level that goes up and down by 3 between groups."""
    rng = np.random.default_rng(4)
    steady = rng.standard_normal((24_000, 2))
    level = np.repeat([1.0, 3.0], 1000)
    bursts = steady * np.resize(level, len(steady))[:, None]
    cut = plan(8000, 50.0, 2)
    trust = [steadiness(spectra_of(v, cut)).mean() for v in (steady, bursts)]
    assert trust[0] > 0.95
    assert trust[1] < 0.8


def test_the_level_is_not_that_of_the_loudest_mode():
    """Another record of one structure: within 4 of the spread that it is told with."""
    one, two = chain(5), chain(6)
    cut = plan(len(one.values), RATE_HZ, 3)
    first, second = (spectra_of(s.values, cut) for s in (one, two))
    level, std = level_of(first.mean, second.mean, first.freedom, second.freedom)
    assert std < 0.1
    assert abs(level) < 4 * std


def test_channels_that_follow_each_other_closely_lead_to_their_gain():
    """Two channels of one motion, 0.1 % noise: the slope at null tells no size, the grid does."""
    one, two = chain(7, channels=2), chain(8, channels=2)
    rng = np.random.default_rng(9)

    def twins(samples, gain):
        motion = samples.values[:, :1]
        both = motion * [1.0, gain]
        return both + 1e-3 * motion.std() * rng.standard_normal(both.shape)
    first, second = twins(one, 1.0), twins(two, 1.3)
    cut = plan(len(first), RATE_HZ, 2)
    before, after = spectra_of(first, cut), spectra_of(second, cut)
    nominal = make_nominal(first, ('a', 'b'), cut, before.mean, before)
    form = [f for f in all_forms(nominal, ('sensor_gain',)) if f.place['channel'] == 'b'][0]
    found, _ = bracketed(nominal, form, after.mean, before.freedom, after.freedom)
    assert found.begin[0] == pytest.approx(0.3, abs=0.02)       # the refinement is to 1 %


def test_a_clipped_record_with_a_copied_channel_is_told_and_does_not_fail():
    """A copy has no determinant, and clipping takes more than some groups hold."""
    one, two = chain(10, 60.0, channels=2), chain(11, 60.0, channels=2)
    copied = [np.column_stack([s.values, s.values[:, 0]]) for s in (one, two)]
    limit = copied[1].std()
    found = diagnose_reference(*(Samples(v, RATE_HZ, ('a', 'b', 'c')) for v in (
        copied[0], np.clip(copied[1], -limit, limit))))
    assert 'saturation' in found.candidates[0].effects


def test_rounded_values_have_no_rail():
    """A signal that repeats itself shows its extreme in every period."""
    once = np.random.default_rng(12).standard_normal(1000)
    values = np.rint(np.tile(once, 10) / 0.3) * 0.3
    assert limit_of(values) == 0.0
    assert limit_of(np.clip(values, -1.5, 1.5)) == pytest.approx(1.5)


def test_noise_far_below_the_motion_is_no_gap():
    """0.2 % of the rms in the record alone, where the reference has none."""
    one, two = chain(13), chain(14)
    rng = np.random.default_rng(15)
    quiet = [changed(s, s.values * 100) for s in (one, two)]
    loud = changed(two, quiet[1].values + 2e-3 * quiet[1].values.std() * rng.standard_normal(
        two.values.shape))
    assert diagnose_reference(quiet[0], loud).outcome == 'WITHIN_FLOOR'
    pair = dithered(make_pair(quiet[0], loud))
    assert np.array_equal(pair.reference, dithered(make_pair(quiet[0], loud)).reference)


def test_knocks_are_named():
    """Ten knocks that ring at frequencies of their own, twice as high as the motion."""
    one, two = chain(16), chain(17)
    rng = np.random.default_rng(18)
    t = np.arange(400) / RATE_HZ
    values = two.values.copy()
    for row in rng.integers(0, len(values) - 400, 10):
        ring = 5.0 * values.std() * np.exp(-1.5 * t) * np.cos(2 * np.pi * 7.3 * t)
        values[row:row + 400] += ring[:, None] * [1.0, 0.5, -0.7]
    found = diagnose_reference(one, changed(two, values))
    # they ring at a frequency of their own, which no impulse on this structure does
    assert 'impulsive_events' in found.candidates[0].effects
    assert found.outcome != 'WITHIN_FLOOR'


def paced(values):
    """Return what is left of a recording beyond the pace of its motion."""
    way = predictor(values)
    return way.slew_normalised(values, way.residual(values))


def slow_motion(seed, jitter_s=0.0):
    """Return displacements of one mode at 2 Hz, (n, 2), with 1 % of noise; instants may err."""
    rng = np.random.default_rng(seed)
    pole = np.exp((-0.01 + 1j) * 2 * np.pi * 2.0 / RATE_HZ)
    force = rng.standard_normal(21_000)
    motion = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)[1000:]
    motion = motion / motion.std()
    motion = motion + np.gradient(motion) * RATE_HZ * jitter_s * rng.standard_normal(len(motion))
    return motion[:, None] * [1.0, 0.7] + 0.01 * rng.standard_normal((len(motion), 2))


def test_what_is_large_where_the_motion_is_fast_is_no_pulse():
    """Instants wrong by 2 ms: errors go with the pace, in moments and over minutes."""
    one, two = slow_motion(19), slow_motion(20, 2e-3)

    def tail(left):
        power = (left ** 2).mean(axis=1)
        return np.mean(power ** 2) / power.mean() ** 2 - 2.0    # of two channels of noise: 0
    # a pace that is foretold is not quite the pace that was: some of the tail is left
    assert tail(paced(two)) < 0.3 * tail(predictor(two).residual(two))
    # a level that swings goes with the pace, too, but is not taken out
    t = np.arange(len(one)) / RATE_HZ
    swung = slow_motion(21) * (1 + 0.4 * np.sin(2 * np.pi * t / 130.0))[:, None]
    found = modulation(paced(one), paced(swung), RATE_HZ)
    assert found[0] < 1e-3


def test_a_short_recording_does_not_wander_more():
    """White noise of a fifth of the length: shorter windows would scatter five times as much."""
    rng = np.random.default_rng(22)
    assert modulation(rng.standard_normal((30_000, 1)), rng.standard_normal((6000, 1)),
                      RATE_HZ) is None
