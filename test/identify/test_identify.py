"""The whole chain: modes found, none invented, cuts do not matter, bad input has a reason."""
import numpy as np
import pytest

from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import Identification, identify, Monitor
from ssi_ros.identify.explain import explain
from ssi_ros.identify.shapes import mac
from ssi_ros.records import Samples

NAMES = ('a', 'b', 'c', 'd')
MINUTE = Identification(window_s=60.0, hop_s=10.0)


def record(values, rate_hz=100.0):
    """Return samples of values with one-letter names."""
    return Samples(values, rate_hz, tuple('abcdefgh'[:values.shape[1]]))


@pytest.fixture(scope='module')
def pairs():
    """Return four minutes of two close pairs that differ in shape."""
    rng = np.random.default_rng(3)
    return accelerations(PAIR_HZ, PAIR_SHAPES, 240.0, rng)


def test_close_pairs_stay_two_modes_with_their_own_shapes(pairs):
    """Lags that are transposed leave the poles right and turn these shapes to MAC 0.6."""
    window = identify(record(pairs), Identification(window_s=240.0, hop_s=10.0))[-1]
    found = np.array([m.frequency_hz for m in window.modes])
    assert len(found) == 4, explain(window, 15.8)
    likeness = mac(np.array([m.shape for m in window.modes]), PAIR_SHAPES)
    partner = likeness.argmax(axis=1)
    assert sorted(partner) == [0, 1, 2, 3]
    # 6.4 Hz pairs are 3 half-widths apart, so their shapes part well in 240 s
    assert (likeness.max(axis=1)[:2] > 0.98).all()
    # five times the spread of 0.04 % that 240 s allow
    assert np.abs(found / PAIR_HZ[partner] - 1.0).max() < 2e-3
    assert {m.label for m in window.modes} == {'structural'}


def test_result_does_not_depend_on_the_cuts(pairs):
    """Rows in one piece and rows in odd pieces give the same bits."""
    whole = Monitor(NAMES, 100.0, 0, MINUTE).push(pairs[:9000])
    monitor, pieces, at = Monitor(NAMES, 100.0, 0, MINUTE), [], 0
    for size in np.random.default_rng(1).integers(1, 700, 1000):
        pieces += monitor.push(pairs[at:min(at + size, 9000)])
        at = min(at + size, 9000)
    assert len(whole) == len(pieces) == 4
    for a, b in zip(whole, pieces):
        assert [m.frequency_hz for m in a.modes] == [m.frequency_hz for m in b.modes]
        assert [m.damping_ratio_std for m in a.modes] == [m.damping_ratio_std for m in b.modes]
        assert (a.start_ns, a.end_ns) == (b.start_ns, b.end_ns)


def test_windows_end_on_hops_and_identities_stay(pairs):
    """The first window ends after window_s, the next a hop later; the names do not change."""
    windows = identify(record(pairs), MINUTE)
    assert [w.end_ns for w in windows] == [round(1e9 * s) for s in range(60, 241, 10)]
    strong = [m.identity for m in windows[0].modes if m.frequency_hz < 7.0]
    for window in windows:
        assert [m.identity for m in window.modes if m.frequency_hz < 7.0] == strong


def test_noise_has_no_modes(rng):
    """White noise gives no mode, and the reason says so."""
    window = identify(record(rng.standard_normal((6000, 4))), MINUTE)[-1]
    assert window.modes == ()
    assert 'noise' in window.reason


@pytest.mark.parametrize('frequency_hz', [12.0, 15.788])
def test_a_line_is_no_mode(pairs, frequency_hz):
    """A line far from the modes, and one 0.3 % beside a mode, are told from them."""
    t = np.arange(len(pairs)) / 100.0
    values = pairs + 0.2 * np.outer(np.sin(2.0 * np.pi * frequency_hz * t), [1, 0.8, 0.3, -0.5])
    window = identify(record(values), Identification(window_s=240.0, hop_s=10.0))[-1]
    lines = [m for m in window.modes if m.label == 'input_line']
    # a tenth of the spectral resolution of 240 s
    assert [m.frequency_hz for m in lines] == [pytest.approx(frequency_hz, abs=4e-4)]
    assert sum(m.label == 'structural' for m in window.modes) == 4


@pytest.mark.parametrize('spoil, word', [
    (lambda v: v * 0.0, 'constant'),
    (lambda v: v * np.nan, 'misses'),
    (lambda v: np.repeat(v[:, :1] * 0.0 + 3.0, 4, axis=1), 'constant'),
])
def test_nothing_to_identify_has_a_reason(pairs, spoil, word):
    """Records without information give no modes and say why."""
    window = identify(record(spoil(pairs[:6000])), MINUTE)[-1]
    assert window.modes == () and word in window.reason


def _spike(v):
    v = v.copy()
    v[1234, 2] = 1e300
    return v


def _copy(v):
    v = v.copy()
    v[:, 1] = v[:, 0]
    return v


@pytest.mark.parametrize('spoil, word', [
    (_spike, 'missing'), (_copy, 'identical'), (lambda v: v * [1, 1, 0, 1], 'constant')])
def test_one_bad_channel_is_named_and_the_rest_identified(pairs, spoil, word):
    """A broken channel does not blind the others."""
    window = identify(record(spoil(pairs[:6000])), MINUTE)[-1]
    assert word in window.reason
    assert any(abs(m.frequency_hz - 6.345) < 0.05 for m in window.modes)


@pytest.mark.parametrize('size', [1e3, 1e12, 1e40, 1e99, 1e150, 1e300])
def test_a_wild_sample_leaves_with_its_window(pairs, size):
    """In the first hop it must not stay in the offset: once it has left, all is as without."""
    values = pairs[:13000].copy()
    values[321, 2] = -size
    last = identify(record(values), MINUTE)[-1]
    clean = identify(record(pairs[:13000]), MINUTE)[-1]
    # the median of the hop moves by a rank, which the windows' own mean removes: rounding
    np.testing.assert_allclose([m.frequency_hz for m in last.modes],
                               [m.frequency_hz for m in clean.modes], rtol=1e-6)


@pytest.mark.parametrize('size', [1e3, 1e12, 1e40, 1e99])
def test_a_wild_sample_invents_no_mode(pairs, size):
    """While it is in the window a mode may be lost, but none appears elsewhere."""
    values = pairs[:6000].copy()
    values[1321, 2] = size
    for mode in identify(record(values), MINUTE)[-1].modes:
        # 1 % is ten spreads of a minute
        assert abs(PAIR_HZ / mode.frequency_hz - 1.0).min() < 0.01, mode


@pytest.mark.parametrize('scale', [1e-9, 1e6])
def test_units_do_not_matter(pairs, scale):
    """The same record in other units has the same modes: equal to rounding."""
    plain = identify(record(pairs[:6000]), MINUTE)[-1].modes
    scaled = identify(record(pairs[:6000] * scale), MINUTE)[-1].modes
    np.testing.assert_allclose([m.frequency_hz for m in scaled],
                               [m.frequency_hz for m in plain], rtol=1e-8)


def test_missing_samples(pairs, rng):
    """With 2 % of the samples missing the modes stay where they are."""
    values = pairs.copy()
    values[rng.random(values.shape) < 0.02] = np.nan
    found = [m.frequency_hz for m in identify(record(values[:12000]), MINUTE)[-1].modes]
    # a minute allows a spread of 0.1 %
    for f in (6.345, 6.445):
        assert min(abs(np.array(found) / f - 1.0)) < 0.005


def test_short_record_says_what_it_needs(pairs):
    """A record shorter than the window says both lengths."""
    window, = identify(record(pairs[:1000]), MINUTE)
    assert '10 s' in window.reason and '60 s' in window.reason


@pytest.mark.parametrize('settings, word', [
    ({'window_s': 10.0, 'hop_s': 3.0}, 'whole number'), ({'weighting': 'none'}, 'known: cva'),
    ({'window_s': -1.0}, 'outside'), ({'order_max': 1}, 'outside')])
def test_settings_are_checked(settings, word):
    """Settings that cannot work say what is allowed."""
    with pytest.raises(ValueError, match=word):
        Identification(**settings)


def test_too_few_samples_for_the_block_rows():
    """The message says how many samples are needed."""
    with pytest.raises(ValueError, match='needs 240 or more'):
        Monitor(('a',), 100.0, 0, Identification(window_s=1.0, hop_s=0.5))


def test_identify_now_says_how_full_the_window_is(pairs):
    """An empty and a half-full window say so, and asking leaves the monitor as it was."""
    monitor = Monitor(NAMES, 100.0, 0, MINUTE)
    assert 'no whole hop' in monitor.identify_now().reason
    monitor.push(pairs[:3000])
    assert '30 s of 60 s' in monitor.identify_now().reason
    window, = monitor.push(pairs[3000:6000])
    assert sorted(m.identity for m in window.modes) == sorted(window.births)


def test_explain_names_mode_and_reasons(pairs):
    """The mode is told with its spread, an empty place as empty."""
    window = identify(record(pairs[:6000]), MINUTE)[-1]
    assert 'mode' in explain(window, 6.345)
    with pytest.raises(ValueError, match='positive'):
        explain(window, -1.0)


def test_one_hop_has_no_spreads_and_no_doubles(pairs):
    """Without spreads the bands still agree on one candidate a mode."""
    settings = Identification(window_s=240.0, hop_s=240.0)
    found = [m.frequency_hz for m in identify(record(pairs), settings)[-1].modes]
    # four modes were put in; a mode seen by two bands would come twice
    assert len(found) == 4
