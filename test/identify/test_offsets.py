"""Channels sampled at other instants: moved exactly, or refused with a sentence."""
import numpy as np
import pytest

from ssi_ros.bag import Channel, Recording
from ssi_ros.effects import effect_class
from ssi_ros.gap.detectors.samples import detect_quantisation
from ssi_ros.identify.offsets import EDGE, moved, offsets, SHORT
from ssi_ros.report.samples import samples_of

START, RATE = 1_700_000_000_000_000_000, 100.0


def wave(t):
    """Return three vibrations, one at 0.45 of the rate, and a line."""
    return (np.sin(2 * np.pi * 3.1 * t) + np.sin(2 * np.pi * 21.7 * t + 1.0)
            + np.sin(2 * np.pi * 45.0 * t + 2.0) + 0.01 * t)


def recorded(*columns):
    """Return a recording of (times [s], values) a channel."""
    stamps = tuple(START + np.rint(t * 1e9).astype(np.int64) for t, _ in columns)
    return Recording(tuple(Channel(f'/{n}') for n, _ in zip('abc', columns)), stamps,
                     tuple(v for _, v in columns), stamps, (False,) * len(columns))


@pytest.mark.parametrize('offset_ms', [3.0, -4.5, 0.1])
def test_a_channel_is_moved_to_the_instants_of_the_first(offset_ms):
    """Behind the edges a channel is what it was at the other instants, to 2e-3 of its size."""
    t, said = np.arange(6000) / RATE, []
    late = t + 1e-3 * offset_ms
    samples = samples_of(recorded((t, wave(t)), (late, wave(late))), say=said.append)
    assert said == [f'sampled beside a: b {offset_ms:+.3g} ms; moved to its instants']
    # ends that do not meet leave a trace that falls with the square of the distance
    np.testing.assert_allclose(samples.values[200:-200, 1], samples.values[200:-200, 0],
                               atol=2e-3 * 3)
    assert np.isfinite(samples.values).all() and len(samples.values) >= 6000 - 2 * EDGE - 1


def test_steps_of_a_converter_show_in_what_was_sampled():
    """They are gone from a channel that was moved, and its record keeps them."""
    t, step = np.arange(6000) / RATE, 0.05
    late = t + 3e-3
    samples = samples_of(recorded(*((x, np.rint(wave(x) / step) * step) for x in (t, late))))
    assert detect_quantisation(effect_class('quantisation'), samples) is None
    found = detect_quantisation(effect_class('quantisation'), samples.before_moves)
    assert found.parameters['step_m_s2'] == pytest.approx(step)
    part = samples.between(1.0, 2.0)
    assert part.as_sampled.shape == part.values.shape
    np.testing.assert_array_equal(part.before_moves.values, part.as_sampled)


@pytest.mark.parametrize('later', [(0.0, 0.54, 0.08), (0.0, 0.16, 0.57), (0.57, 0.0, 0.16),
                                   (0.0, -0.45, 0.45), (0.3, 0.9, 0.6)])
def test_no_channel_is_a_whole_sample_off(later):
    """Of three channels, the last to begin sets where rows begin; all show the same motion."""
    t = np.arange(6000) / RATE
    times = [t + share / RATE for share in later]
    samples = samples_of(recorded(*((x, wave(x)) for x in times)))
    for other in (1, 2):
        np.testing.assert_allclose(samples.values[200:-200, other], samples.values[200:-200, 0],
                                   atol=2e-3 * 3)


def test_single_missing_samples_do_not_end_a_run(rng):
    """With 3 % lost at random a channel is moved to 2 % of its size, and lacks no more."""
    t = np.arange(6000) / RATE
    late, lost = t + 3.6e-3, rng.random(6000) < 0.03

    def slow(t):
        return np.sin(2 * np.pi * 3.1 * t) + np.sin(2 * np.pi * 21.7 * t + 1.0)
    samples = samples_of(recorded((t, slow(t)), (late[~lost], slow(late[~lost]))))
    one, other = samples.values[200:-200].T
    assert 0.02 < np.isnan(other).mean() < 0.04 and np.isfinite(one).all()
    assert np.nanstd(other - one) < 0.02


def test_noise_keeps_its_spectrum(rng):
    """White noise stays white up to half of the rate, also between gaps."""
    x = rng.standard_normal(2 ** 16)
    x[30000:30100] = np.nan
    y = moved(x, 0.37)
    assert np.isnan(y[30000 - EDGE:30100 + EDGE]).all()
    power = np.abs(np.fft.rfft(y[40000:60000])) ** 2
    # each mean of 1000 bins of unit exponentials scatters by 3 %
    np.testing.assert_allclose(power.reshape(-1)[:10000].reshape(10, 1000).mean(axis=1) / 20000,
                               1.0, atol=0.15)


def test_losses_and_drifts_are_refused(rng):
    """Where a channel cannot be moved, or its clock runs away, a sentence says so."""
    t = np.arange(6000) / RATE
    kept = t[np.arange(6000) % 70 > 2 * SHORT]
    with pytest.raises(ValueError, match=r'b is sampled \+3 ms beside a, and too many'):
        samples_of(recorded((kept, wave(kept)), (kept + 0.003, wave(kept + 0.003))))
    slow = np.arange(5990) / 99.95
    with pytest.raises(ValueError, match='the clock of b runs away from that of a by 2.9'):
        samples_of(recorded((t, wave(t)), (slow, wave(slow))))


def test_jitter_and_a_common_drift_are_none(rng):
    """Uneven stamps on one clock, and all channels at 100.03 Hz: nothing to move."""
    t = np.arange(20000) / 100.03
    jitter = [START + np.rint((t + rng.normal(0, 1e-3, 20000)) * 1e9).astype(np.int64)
              for _ in range(2)]
    for o in offsets(jitter, RATE, START, START + 10 ** 12):
        # 1 ms of 20,000 stamps: a standard deviation of 1e-3 samples
        assert abs(o.offset) < 5e-3 and abs(o.drift) < 0.02


def test_offsets_of_a_long_record_are_those_of_a_whole_one(monkeypatch, rng):
    """Sums over stamps that are looked at in pieces are the same to the bit, sorted or not."""
    period = round(1e9 / RATE)
    stamps = [np.arange(5000) * period + 10 ** 18 + rng.integers(-90_000, 90_000, 5000)
              + late for late in (0, 310_000, 0)]
    stamps[1][700:900] = stamps[1][700:900][::-1]
    stamps.append(stamps[2].copy())

    def found():
        return offsets(stamps, RATE, int(stamps[0][0]), int(stamps[2][-1]))
    whole = found()
    assert whole[2] == whole[3] and whole[1].offset == pytest.approx(0.31e-3 * RATE, abs=1e-3)
    monkeypatch.setattr('ssi_ros.identify.offsets.MOST', 333)
    assert found() == whole
