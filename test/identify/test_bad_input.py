"""Bad input gives a reason, never a crash and never a mode that is not there."""
import warnings

import numpy as np
import pytest

from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import Identification, identify, Monitor
from ssi_ros.model import assemble, load_spacecraft, simulate
from ssi_ros.records import Samples

MINUTE = Identification(window_s=60.0, hop_s=10.0)
ROWS = 6000


@pytest.fixture(scope='module')
def minute():
    """Return a minute of two close pairs at four channels."""
    return accelerations(PAIR_HZ, PAIR_SHAPES, 60.0, np.random.default_rng(3))


def last_window(values):
    """Identify values of any number of channels; a warning of NumPy is a fault."""
    names = tuple('abcdefgh'[:values.shape[1]])
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        return identify(Samples(values, 100.0, names), MINUTE)[-1]


def invented(window):
    """Return the modes that are none of the four; 1 % is ten spreads of a minute."""
    return [m for m in window.modes if abs(PAIR_HZ / m.frequency_hz - 1.0).min() > 0.01]


def found(window):
    """Return how many of the two pairs, at 6.4 and at 15.8 Hz, were found at all."""
    f = np.array([m.frequency_hz for m in window.modes])
    return sum(bool(len(f)) and abs(f - pair).min() < 0.01 * pair for pair in (6.4, 15.84))


def test_the_record_itself_is_sound(minute):
    """What the other tests spoil is found without being spoilt."""
    window = last_window(minute)
    assert window.reason == '' and found(window) == 2 and not invented(window)


NOTHING = {
    'zeros': (lambda v: 0.0 * v, 'constant'),
    'one value': (lambda v: 0.0 * v + 9.81, 'constant'),
    'a value and its rounding': (lambda v: 9.81 + 1e-15 * v, 'constant'),
    'no number at all': (lambda v: np.nan * v, 'misses 100 %'),
    'a ramp': (lambda v: np.outer(np.arange(ROWS), [1.0, 2.0, 3.0, 4.0]), 'identical'),
    'one impulse': (lambda v: np.outer(np.arange(ROWS) == 3000, [1.0, 2.0, 3.0, 4.0]) * 1.0,
                    'identical'),
    'infinite': (lambda v: v / 0.0, 'misses'),
    'beyond all numbers': (lambda v: v * 1e306, 'misses'),
    'in units of 1e-160': (lambda v: v * 1e-160, 'constant'),
    'zeros but for twelve seconds': (lambda v: np.where(np.arange(ROWS)[:, None] < 4800, 0.0, v),
                                     'stands still in 75 %'),
    'zeros but for two seconds': (lambda v: np.where(np.arange(ROWS)[:, None] < 5800, 0.0, v),
                                  'stands still in 95 %'),
    'every second sample missing': (
        lambda v: np.where(np.arange(ROWS)[:, None] % 2, v, np.nan), 'some lags have no pairs'),
    'white noise': (lambda v: np.random.default_rng(1).standard_normal(v.shape), 'noise'),
    'a random walk': (lambda v: np.random.default_rng(1).standard_normal(v.shape).cumsum(axis=0),
                      'noise'),
}


@pytest.mark.parametrize('case', NOTHING)
def test_nothing_to_find(minute, case):
    """Where nothing vibrates there is no mode and a reason."""
    spoil, word = NOTHING[case]
    with np.errstate(all='ignore'):
        values = spoil(minute)
    window = last_window(values)
    assert window.modes == () and word in window.reason


def _with(values, *places):
    values = values.copy()
    for rows, column, value in places:
        values[rows, column] = value
    return values


ALL = slice(None)
SPOILT = {        # what is done: (record, words of the reason, pairs that are still there)
    'identical channels': (lambda v: v[:, [0, 0, 2, 2]], 'a and b are identical', 1),
    'all identical': (lambda v: v[:, [0, 0, 0, 0]], 'a and d are identical', 2),
    'a channel is the sum of two': (
        lambda v: np.column_stack([v[:, :3], v[:, 0] + v[:, 1]]), '', 2),
    'rank two of four': (
        lambda v: v[:, :2] @ np.array([[1.0, 0.0, 1.0, 2.0], [0.0, 1.0, 1.0, -1.0]]), '', 1),
    'a channel is another one later': (
        lambda v: np.column_stack([v[:, :3], np.roll(v[:, 0], 1)]), '', 2),
    'a constant channel': (lambda v: _with(v, (ALL, 2, 5.0)), 'channel c is constant', 2),
    'a dead channel': (lambda v: _with(v, (ALL, 2, np.nan)), 'channel c misses 100 %', 2),
    'one channel': (lambda v: v[:, :1], '', 2),
    '1e300 once': (lambda v: _with(v, (1234, 2, 1e300)), '1 samples beyond', 2),
    '-1e300 first': (lambda v: _with(v, (0, 0, -1e300)), '1 samples beyond', 2),
    'infinite once': (lambda v: _with(v, (700, 1, np.inf)), '1 samples beyond', 2),
    'zeros in the second half': (lambda v: _with(v, (slice(3000, None), ALL, 0.0)), '', 2),
    'half a minute missing': (
        lambda v: _with(v, (slice(2000, 5000), ALL, np.nan)),
        '50 % of the samples are missing, the longest gap 30 s on all channels', 2),
    'a channel missing for ten seconds': (
        lambda v: _with(v, (slice(2000, 3000), 1, np.nan)), '', 2),
    'two channels never together': (
        lambda v: _with(v, (slice(0, 2900), 0, np.nan), (slice(3100, None), 1, np.nan)),
        'channel a is missing or stands still in 50 % of the window and is left out', 1),
    'all but the last second missing': (
        lambda v: _with(v, (slice(0, 5900), ALL, np.nan)), 'misses 98 %', 0),
    **{f'in units of 1e{k}': (lambda v, k=k: v * 10.0 ** k, '', 2) for k in (-9, -6, 3, 6)},
    'units that differ by 1e15': (lambda v: v * [1e-9, 1.0, 1e6, 1e3], '', 2),
    'coarse steps': (lambda v: np.round(v, 1), '', 2),
    'a channel missing for 25 seconds': (
        lambda v: _with(v, (slice(2000, 4500), 1, np.nan)),
        'channel b is missing or stands still in 45 % of the window and is left out', 2),
    'every second sample of a channel missing': (
        lambda v: _with(v, (slice(0, None, 2), 2, np.nan)), 'channel c misses samples so', 0),
    'a channel that died at 60 %': (lambda v: _with(v, (slice(3600, None), 3, np.nan)),
                                    'channel d is missing or stands still in 45 % of the window '
                                    'and is left out', 2),
    'a channel of zeros for most of the time': (
        lambda v: _with(v, (slice(0, 4800), 1, 0.0)), 'channel b is missing or stands still', 2),
    'units that differ by 1e160': (lambda v: v * [1e-160, 1.0, 1.0, 1e-100],
                                   'channel a is constant', 2),
}


@pytest.mark.parametrize('case', SPOILT)
def test_spoilt_records(minute, case):
    """The fault is named, what can still be seen is found, and nothing is invented."""
    spoil, words, pairs = SPOILT[case]
    window = last_window(spoil(minute))
    assert words in window.reason
    assert invented(window) == []
    assert found(window) >= pairs
    for mode in window.modes:
        assert np.isfinite([mode.frequency_hz, mode.damping_ratio, *abs(mode.shape)]).all()


def test_gaps_keep_the_band_of_slow_modes():
    """A fifth missing in gaps of half a second leaves covariances that can be factorised."""
    reasons = []
    for seed in range(24_000_000, 24_000_003):
        record = simulate(assemble(load_spacecraft()), 120.0, seed)
        values = np.array(record.values)
        starts = np.sort(np.random.default_rng(seed).choice(9600, 48, replace=False))
        for k, start in enumerate(starts):
            values[start + 50 * k:start + 50 * (k + 1)] = np.nan
        window = identify(Samples(values, 100.0, record.channels),
                          Identification(window_s=120.0, hop_s=2.0))[-1]
        reasons.append(window.reason)
        assert window.reason.startswith('20 % of the samples are missing')
        assert len(window.modes) >= 17          # of the 20 that the whole record gives
    assert not any('positive definite' in r for r in reasons)


def test_few_scattered_losses_are_not_worth_a_word(minute):
    """Half a percent lost one by one leaves the reason empty; one gap of a second does not."""
    lost = np.random.default_rng(5).random(minute.shape) < 0.005
    assert last_window(np.where(lost, np.nan, minute)).reason == ''
    gap = last_window(_with(minute, (slice(700, 820), 2, np.nan)))
    assert gap.reason == '0.5 % of the samples are missing, the longest gap 1.2 s on c'
    assert found(gap) == 2


@pytest.mark.parametrize('share', [0.02, 0.05, 0.1, 0.2])
def test_scattered_missing_samples_invent_nothing(minute, share):
    """Pairs lost at random leave errors in the covariances; they are no modes."""
    lost = np.random.default_rng(4).random(minute.shape) < share
    window = last_window(np.where(lost, np.nan, minute))
    assert found(window) == 2
    # a whole record gives one in ten windows; without the lift 5 % missing gave more than three
    assert len(invented(window)) <= 1


@pytest.mark.parametrize('rows', [0, 1, 2, 100, 5999])
def test_a_record_shorter_than_the_window(minute, rows):
    """What is there and what is needed are told."""
    window = last_window(minute[:rows])
    assert window.modes == ()
    assert f'holds {rows / 100:g} s' in window.reason and 'needs 60 s' in window.reason


@pytest.mark.parametrize('settings, words', [
    ({'window_s': 2.0, 'hop_s': 1.0, 'block_rows': 60}, 'block_rows=60 needs 240 or more'),
    ({'window_s': 0.1, 'hop_s': 0.1}, 'needs 120 or more'),
    ({'window_s': 60.0, 'hop_s': 0.001}, 'at least 0.01 is needed')])
def test_windows_that_cannot_hold_the_block_rows(settings, words):
    """The message says how many samples, or how long a hop, there must be."""
    with pytest.raises(ValueError, match=words):
        Monitor(tuple('abcd'), 100.0, 0, Identification(**settings))


def test_windows_of_zeros_pass(minute):
    """Between two stretches of life a window of zeros has a reason; the next life is found."""
    values = np.concatenate([minute, np.zeros((ROWS, 4)), minute])
    windows = Monitor(tuple('abcd'), 100.0, 0, MINUTE).push(values)
    dead = windows[6]                           # from 60 s to 120 s
    assert dead.modes == () and 'constant' in dead.reason
    assert found(windows[0]) == found(windows[-1]) == 2
    assert invented(windows[-1]) == []


@pytest.mark.parametrize('values, words', [
    (np.zeros((5, 3)), 'one column a channel'), (np.zeros(5), 'one column a channel')])
def test_rows_of_the_wrong_shape(values, words):
    """The shape that is needed is told."""
    with pytest.raises(ValueError, match=words):
        Monitor(tuple('abcd'), 100.0, 0, MINUTE).push(values)


@pytest.mark.parametrize('rate_hz', [0.0, -1.0, np.nan, np.inf])
def test_rates_that_are_none(rate_hz):
    """A rate is a positive number."""
    with pytest.raises(ValueError, match='positive'):
        Monitor(tuple('abcd'), rate_hz, 0, MINUTE)


@pytest.mark.parametrize('count', [0, 65])
def test_numbers_of_channels(count):
    """One to 64 channels are identified together."""
    with pytest.raises(ValueError, match='1 to 64'):
        Monitor(tuple(map(str, range(count))), 100.0, 0, MINUTE)


@pytest.mark.parametrize('hz, size', [
    (3.7, 0.05), (3.7, 1.0), (3.71, 0.3), (1.3, 1.0), (5.03, 1.0), (7.77, 0.3)])
def test_the_harmonics_of_a_square_wave_are_no_modes(minute, hz, size):
    """A machine that knocks: its harmonics, folded ones too, are never called structural."""
    t = np.arange(ROWS) / 100.0
    wave = np.sign(np.sin(2.0 * np.pi * hz * t + 0.3))
    window = last_window(minute + size * np.outer(wave, [1.0, 0.5, 0.3, 0.8]))
    assert found(window) == 2
    others = invented(window)
    assert others and [m for m in others if m.label == 'structural'] == []
