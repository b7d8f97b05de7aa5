"""What no mean spectrum shows: sweeps, pulses of one shape, modes inside a band, new modes."""
import numpy as np
import pytest
from reference_records import chain, diagnose_reference, MODES, RATE_HZ, SHAPES
from scipy.signal import lfilter
from ssi_ros.events.common_shape import learn, matched
from ssi_ros.events.prediction_error import predictor
from ssi_ros.gap.nominal.modal.reference import identified
from ssi_ros.gap.nominal.stationary.chirp import sweep
from ssi_ros.gap.nominal.stationary.impulses import pulses
from ssi_ros.gap.nominal.stationary.tone import skirts
from ssi_ros.records import Samples
from ssi_ros.regimes.frequency_shift import modes_again, shifted_modes

SECONDS = 400.0


def lefts(*records):
    return [predictor(r.values).residual(r.values) for r in records]


def swept(samples, start, end, size):
    t = np.arange(len(samples.values)) / RATE_HZ
    phase = 2 * np.pi * (start * t + (end - start) * t ** 2 / (2 * t[-1]))
    wave = size * samples.values.std(axis=0) * np.sin(phase)[:, None]
    return Samples(samples.values + wave, RATE_HZ, samples.channels)


@pytest.mark.parametrize('ends', [(3.0, 12.0), (20.0, 8.0), (6.0, 8.0)])
@pytest.mark.parametrize('channels', [1, 3])
def test_a_sweep_is_found_with_its_ends(ends, channels):
    """A tenth of the rms in each channel, at any rate; the ends to a bin of the pieces."""
    one, two = (chain(s, SECONDS, channels=channels) for s in (61, 62))
    found = sweep(*lefts(one, swept(two, *ends, 0.1)), RATE_HZ)
    assert found[1:3] == pytest.approx(ends, abs=0.4)


def test_no_sweep_is_found_in_none_nor_in_one_that_the_reference_has():
    """Two records of a chain, a line, and the same sweep in both."""
    one, two = (chain(s, SECONDS) for s in (63, 64))
    assert sweep(*lefts(one, two), RATE_HZ) is None
    assert sweep(*lefts(one, swept(two, 7.0, 7.0, 0.3)), RATE_HZ) is None
    assert sweep(*lefts(*(swept(r, 3.0, 12.0, 0.2) for r in (one, two))), RATE_HZ) is None


def test_a_strong_sweep_is_named_and_closes_its_gap():
    """Half of the rms: 8 % of the bands of the groups are left out, and the gap is gone."""
    found = diagnose_reference(chain(65, SECONDS), swept(chain(66, SECONDS), 3.0, 12.0, 0.5))
    assert found.verdict['effects'] == ('wheel_speed_sweep',)
    assert found.outcome == 'EXPLAINED'


def answered(seed, size, count=30):
    """Return white residuals with `count` waves of one shape, of `size` standard deviations."""
    rng = np.random.default_rng(seed)
    left = rng.standard_normal((20_000, 3))
    wave = lfilter([1.0], [1.0, -1.7, 0.9], np.eye(1, 60)[0])[:, None] * [1.0, -0.6, 0.3]
    wave *= size / np.linalg.norm(wave)
    for at in rng.integers(100, 19_800, count):
        left[at:at + 60] += wave
    return left, wave


def test_pulses_below_the_noise_of_every_sample_are_found_by_their_shape():
    """Eight deviations over sixty samples: no sample stands out; the shape is learnt."""
    quiet = np.random.default_rng(71).standard_normal((20_000, 3))
    left, wave = answered(72, 8.0)
    assert pulses(quiet, left)[1] == pytest.approx(30, rel=0.3)
    # the learnt shape is the wave but for its noise: 0.9 of the root of the wave's energy
    alone = np.pad(wave, ((100, 100), (0, 0)))
    assert np.abs(matched(alone, learn(left))).max() > 0.8 * np.linalg.norm(wave)
    assert pulses(left, quiet) is None
    assert pulses(left, answered(73, 8.0)[0]) is None


def test_the_crests_of_a_level_that_swings_are_no_pulses():
    """Half of the level, twenty times in the record."""
    rng = np.random.default_rng(74)
    one, two = rng.standard_normal((2, 40_000, 3))
    swing = 1 + 0.5 * np.sin(2 * np.pi * np.arange(40_000) / 2000 / 2)[:, None]
    assert pulses(one, two * swing) is None


def test_the_way_back_from_innovations_has_the_spectrum_of_the_record():
    """On the flank of a resonance and far from it: 30 %, thrice the scatter of 200 segments."""
    one = chain(75, 1600.0)
    cycles = np.array([MODES[1][0] * 1.1, 15.0]) / RATE_HZ
    way = predictor(one.values).shaping(cycles)
    made = np.einsum('fij,fij->fi', way, way.conj()).real
    rows = 400
    parts = one.values[:len(one.values) // rows * rows].reshape(-1, rows, 3)
    parts = np.fft.rfft(parts * np.hanning(rows)[:, None], axis=1)
    seen = (np.abs(parts) ** 2).mean(axis=0) / np.sum(np.hanning(rows) ** 2)
    assert made == pytest.approx(seen[np.rint(cycles * rows).astype(int)], rel=0.3)


def test_a_mode_that_moved_inside_a_band_is_seen_and_one_that_stayed_is_not():
    """The second mode 1 % softer; the odds speak for each mode and against all alike."""
    one = chain(81, SECONDS)
    moved = chain(82, SECONDS, scale=(1.0, 0.98, 1.0))
    usual, other, again = (identified(s.values, s.channels, RATE_HZ)
                           for s in (one, moved, chain(83, SECONDS)))
    found = shifted_modes(modes_again(usual, other), 1.0)
    assert found.p_value < 1e-4 and '5.' in found.text
    assert found.each > found.alike + 5.0
    still = shifted_modes(modes_again(usual, again), 1.0)
    assert still.p_value == 1.0 and not still.text


@pytest.mark.slow
def test_a_channel_that_sees_the_modes_otherwise_is_misplaced_and_no_gain():
    """One row of the shapes, each component by its own factor."""
    one, two = chain(84, SECONDS), chain(85, SECONDS)
    modal = two.values @ np.linalg.inv(SHAPES).T
    row = modal @ (SHAPES[1] * [0.9, 1.1, 0.7])
    values = np.column_stack([two.values[:, 0], row, two.values[:, 2]])
    found = diagnose_reference(one, Samples(values, RATE_HZ, one.channels))
    assert found.verdict['effects'] == ('sensor_misplacement',)
    assert 'sensor_misplacement.channel.b' in found.candidates[0].parameters
    whole = np.column_stack([two.values[:, 0], 0.9 * two.values[:, 1], two.values[:, 2]])
    found = diagnose_reference(one, Samples(whole, RATE_HZ, one.channels))
    assert found.verdict['effects'] == ('sensor_gain',)


def test_a_sine_has_no_skirts_and_a_narrow_mode_has():
    """At 0.5 Hz, below the modes of the chain; the mode has no damping, and walks."""
    one, two = chain(86, SECONDS), chain(87, SECONDS)
    t = np.arange(len(two.values)) / RATE_HZ
    sine = two.values + 0.3 * np.sin(2 * np.pi * 0.503 * t)[:, None]
    assert skirts(one.values, sine, 0.5025, RATE_HZ) > 1e-3
    rng = np.random.default_rng(88)
    walk = np.cumsum(rng.standard_normal((len(t), 2)) @ [1, 1j])
    mode = (walk / np.abs(walk).std() * np.exp(2j * np.pi * 0.503 * t)).real
    assert skirts(one.values, two.values + 0.3 * mode[:, None], 0.5025, RATE_HZ) < 1e-3
