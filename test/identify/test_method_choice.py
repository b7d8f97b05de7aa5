"""Every method by the same call: bands, selection, labels and tracks are shared."""
import numpy as np
import pytest
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import Identification, identify, Method
from ssi_ros.identify.shapes import mac
from ssi_ros.records import Samples

HZ, DAMPING = np.array([0.7, 2.3, 5.1, 15.828, 17.0]), 0.005
SHAPES = np.array([[1.0, 1.0, 0.8, 0.8], [1.0, -0.9, -1.0, 0.9], *PAIR_SHAPES[:3]])
MINUTE = Identification(window_s=60.0, hop_s=10.0)


def channels(values):
    """Return values as a record of channels a, b, c and so on."""
    return Samples(values, 100.0, tuple('abcdefg'[:values.shape[1]]))


def decay(seconds, rng, noise):
    """Return the free decay of five modes, with `noise` rms beside amplitudes of 1."""
    t, w = np.arange(round(100.0 * seconds)) / 100.0, 2.0 * np.pi * HZ
    turns = np.sqrt(1.0 - DAMPING ** 2) * np.outer(t, w) + 6.0 * rng.random(5)
    ringing = np.exp(-DAMPING * np.outer(t, w)) * np.cos(turns)
    return ringing @ SHAPES + noise * rng.standard_normal((len(t), 4))


def driven(seconds, rng, noise):
    """Return the accelerations of five modes under two recorded forces, and the forces."""
    n, w = round(100.0 * seconds), 2.0 * np.pi * HZ
    mu = np.exp((-DAMPING + 1j * np.sqrt(1.0 - DAMPING ** 2)) * w / 100.0)
    force = rng.standard_normal((n, 2))
    state, values = np.zeros(5, dtype=complex), np.empty((n, 4))
    gains = np.array([[1.0, 0.4], [0.7, -1.0], [1.0, 0.3], [-0.2, 1.0], [0.9, 0.5]])
    for k in range(n):
        state = mu * state + gains @ force[k]
        values[k] = state.imag @ SHAPES
    values += noise * values.std(axis=0) * rng.standard_normal(values.shape)
    return np.column_stack([values, force])


def check(window, tolerance):
    """Assert that the five modes and no others are there, with their shapes."""
    f = np.array([m.frequency_hz for m in window.modes])
    np.testing.assert_allclose(f, HZ, rtol=tolerance)
    shapes = np.array([m.shape for m in window.modes])
    assert (np.diagonal(mac(shapes, SHAPES.astype(complex))) > 0.99).all()


@pytest.mark.parametrize('noise, tolerance', [(0.0, 1e-6), (1e-3, 1e-4), (0.03, 2e-3)])
def test_era_finds_the_modes_of_a_decay(rng, noise, tolerance):
    """Five modes in three bands, and nothing else; the tolerance grows with the noise."""
    window = identify(channels(decay(60.0, rng, noise)), MINUTE, method=Method('era'))[-1]
    check(window, tolerance)
    assert all(np.isnan(m.frequency_std_hz) for m in window.modes)
    # the slowest falls by e^1.3 in 60 s, which a line does not
    assert [m.label for m in window.modes] == ['structural'] * 5


@pytest.mark.parametrize('noise, tolerance', [(0.0, 5e-4), (1e-3, 5e-4), (0.05, 2e-3)])
def test_okid_finds_the_modes_behind_recorded_forces(rng, noise, tolerance):
    """Five modes in three bands from forces and accelerations, and nothing else."""
    method = Method('okid', ('f', 'g'))
    window = identify(channels(driven(60.0, rng, noise)), MINUTE, method=method)[-1]
    check(window, tolerance)
    assert all(m.shape.shape == (4,) for m in window.modes)


@pytest.mark.parametrize('weighting', ['cva', 'upc'])
def test_ssi_data_has_spreads_that_fit(weighting):
    """Two modes, twelve seeds: the spreads tell the scatter of the frequencies."""
    settings = Identification(window_s=100.0, hop_s=5.0, block_rows=20, weighting=weighting,
                              bands=1)
    error, told, more = [], [], []
    for seed in range(12):
        values = accelerations(PAIR_HZ[:2] * [1.0, 1.3], PAIR_SHAPES[:2], 100.0,
                               np.random.default_rng(seed))
        window = identify(channels(values), settings, method=Method('ssi_data'))[-1]
        for f in PAIR_HZ[:2] * [1.0, 1.3]:
            m = min(window.modes, key=lambda m: abs(m.frequency_hz - f))
            error.append(m.frequency_hz - f)
            told.append(m.frequency_std_hz)
        more.append(len(window.modes) - 2)
    # 24 numbers leave 15 % on their rms
    assert 0.6 < np.sqrt(np.mean(np.square(told)) / np.mean(np.square(error))) < 1.6
    # SSI-COV has one false mode in ten such short windows too
    assert np.mean(more) < 0.2


@pytest.mark.parametrize('name, inputs, words', [
    ('ssi', (), 'known: ssi_cov, ssi_data, era, okid'), ('okid', (), 'name its channel'),
    ('ssi_cov', ('torque',), 'leave it out, or use okid')])
def test_methods_that_cannot_be(name, inputs, words):
    """The message says what the method needs."""
    with pytest.raises(ValueError, match=words):
        Method(name, inputs)


def test_windows_that_a_method_cannot_use(rng):
    """A reason and no modes: no decay for era, missing samples, an input that stands still."""
    settings = Identification(window_s=60.0, hop_s=10.0, bands=1)
    ambient = accelerations(PAIR_HZ, PAIR_SHAPES, 60.0, rng)
    forced = np.column_stack([ambient, np.ones(6000)])
    torn = np.where(np.arange(6000)[:, None] == 2000, np.nan, ambient)
    for values, method, words in (
            (ambient, Method('era'), 'needs the response to a pulse'),
            (torn, Method('ssi_data'), '1 of 6000 rows miss a sample'),
            (torn, Method('era'), 'rows miss a sample, and era needs all'),
            (forced, Method('okid', ('e',)), 'an input is constant')):
        window = identify(channels(values), settings, method=method)[-1]
        assert window.modes == () and words in window.reason, window.reason


def test_a_line_in_a_decay_is_told(rng):
    """A wheel that runs on while the structure rings down: the only one that does not decay."""
    t = np.arange(6000)[:, None] / 100.0
    values = decay(60.0, rng, 1e-3) + 0.05 * np.cos(2.0 * np.pi * 11.3 * t) * [1.0, 0.5, 0.2, 0.9]
    window = identify(channels(values), MINUTE, method=Method('era'))[-1]
    assert {round(m.frequency_hz, 2): m.label for m in window.modes} == {
        0.7: 'structural', 2.3: 'structural', 5.1: 'structural', 11.3: 'input_line',
        15.83: 'structural', 17.0: 'structural'}
