"""Faults of wiring and recorder are named with channel and size; healthy records name none."""

from gap_records import evidence_of, record, SETTINGS
import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.nominal.simulator import at_levels, Simulator
from ssi_ros.gap.spectra.segmentation import make_frame, spectra
from ssi_ros.integrity.repeats import faults_of_samples
from ssi_ros.integrity.wiring import CrossSpectra, faults_of_spectra
from ssi_ros.model import load_spacecraft
from ssi_ros.records import Samples

SECONDS = 200.0
GRAVITY = 9.80665


def swapped(count, i, j):
    """Return the matrix that swaps two channels."""
    return np.eye(count)[[j if k == i else i if k == j else k for k in range(count)]]


def scaled(count, i, factor):
    """Return the matrix that multiplies one channel."""
    return np.diag([factor if k == i else 1.0 for k in range(count)])


def skewed(values, rate_hz, step_s):
    """Return channels (n, l) that are sampled one after another."""
    f = np.fft.rfftfreq(len(values), 1 / rate_hz)[:, None]
    turn = np.exp(-2j * np.pi * f * step_s * np.arange(values.shape[1]))
    return np.fft.irfft(np.fft.rfft(values, axis=0) * turn, len(values), axis=0)


def random_structure(rng, count):
    """Return frequencies [Hz], a spectrum for each input, and that of noise, of random modes."""
    f = np.linspace(0.1, 49.0, 800)
    modes, inputs = rng.integers(3, 12), rng.integers(1, 4)
    natural, damping = rng.uniform(0.3, 45.0, modes), 10 ** rng.uniform(-2.7, -1.5, modes)
    response = f[:, None] ** 2 / (natural ** 2 - f[:, None] ** 2
                                  + 2j * damping * natural * f[:, None])
    h = np.einsum('lm,km,mi->ikl', rng.standard_normal((count, modes)), response,
                  rng.standard_normal((modes, inputs)))
    driven = h[..., :, None] * h[..., None, :].conj()
    power = np.median(np.einsum('ikll->kl', driven).real)
    return f, driven, power * 10 ** rng.uniform(-4, -1) * np.eye(count) * np.ones((len(f), 1, 1))


def averaged(rng, spectrum, averages):
    """Return the mean of so many spectra of Gaussian noise, (k, l, l)."""
    shape = (*spectrum.shape[:2], averages, 2)
    y = np.linalg.cholesky(spectrum) @ rng.standard_normal(shape).view(complex)[..., 0]
    return y @ y.conj().swapaxes(1, 2) / averages / 2


@pytest.mark.parametrize('count', [2, 3, 4, 6])
def test_faults_of_random_structures_at_other_levels(count):
    """Every fault of 15 structures is named, none of the healthy ones, at levels of +-6 dB."""
    rng, names = np.random.default_rng(count), tuple('abcdef'[:count])
    for _ in range(15):
        f, driven, noise = random_structure(rng, count)
        levels = 10 ** rng.uniform(-0.6, 0.6, len(driven) + 1)
        true = np.tensordot(levels[:-1], driven, 1) + levels[-1] * noise
        i, j = rng.choice(count, 2, replace=False)
        step_s = 10 ** rng.uniform(-3.7, -2.9)
        turn = np.exp(-2j * np.pi * f[:, None] * step_s * np.arange(count))
        faults = {
            (): (np.eye(count), ()),
            ('swapped channels',): (swapped(count, i, j), (names[i], names[j])),
            ('reversed polarity',): (scaled(count, i, -1.0), (names[i],) if count > 2 else ()),
            ('unit',): (scaled(count, i, rng.choice([GRAVITY, 1 / GRAVITY])), (names[i],))}
        if count > 2:
            faults[('scan skew',)] = turn[:, :, None] * np.eye(count), ('skew_s',)
        for kinds, (change, named) in faults.items():
            recorded = change @ averaged(rng, true, 10) @ change.conj().swapaxes(-1, -2)
            found = faults_of_spectra(CrossSpectra(
                names, f, driven.sum(axis=0) + noise, true, recorded, 10.0))
            assert tuple(d.kind for d in found) == kinds
            assert all(set(named) <= set(d.sizes) for d in found)


def test_a_slope_beside_a_large_change_is_no_scan_skew():
    """Where later channels explain little of a gap, their phases belong to what makes it."""
    rng, count = np.random.default_rng(7), 4
    f, driven, noise = random_structure(rng, count)
    true = driven.sum(axis=0) + noise
    turn = np.exp(-2j * np.pi * f[:, None] * 1e-3 * np.arange(count))
    low_pass = 1 / np.sqrt(1 + (f[:, None] / np.array([1.0, 3.0, 9.0, 27.0])) ** 2)
    for change, kinds in (turn, ['scan skew']), (turn * low_pass, []):
        change = change[:, :, None] * np.eye(count)
        recorded = change @ averaged(rng, true, 10) @ change.conj().swapaxes(-1, -2)
        found = faults_of_spectra(CrossSpectra(tuple('abcd'), f, true, true, recorded, 10.0))
        assert [d.kind for d in found] == kinds


def cross_spectra(samples, simulator):
    """Return what a comparison with a model gives of a record."""
    evidence, frame = evidence_of(simulator, samples), simulator.frame
    nominal = simulator.expected(Candidate())
    dft = spectra(samples, frame)
    recorded = np.einsum('aki,akj->kij', dft, dft.conj()) / frame.segments
    return CrossSpectra(
        samples.channels, frame.frequencies_hz,
        nominal.at(np.ones(len(nominal.names))).mean(axis=0),
        fit(simulator, evidence).model.mean(axis=0), recorded, frame.segments / frame.inflation)


FAULTS = {
    'swapped channels': lambda v: v @ swapped(4, 0, 2),
    'reversed polarity': lambda v: v @ scaled(4, 1, -1.0),
    'unit': lambda v: v @ scaled(4, 3, 1 / GRAVITY),
    'scan skew': lambda v: skewed(v, 100.0, 1e-3)}
WORDS = {
    'swapped channels': 'e1_a and e2_a are swapped', 'reversed polarity': 'polarity of e1_b is',
    'unit': 'Channel e2_b is in g and not in m/s^2: 0.10',
    'scan skew': 'ms after each other, in the order e1_a, e1_b'}


@pytest.mark.parametrize('kind', FAULTS)
def test_faults_of_a_simulated_record(kind):
    """The sentence names the channels and the size."""
    samples, simulator = record(SECONDS)
    changed = Samples(FAULTS[kind](samples.values), samples.rate_hz, samples.channels)
    found, = faults_of_spectra(cross_spectra(changed, simulator))
    assert found.kind == kind and WORDS[kind] in found.text and found.p_value < 1e-6
    if kind == 'scan skew':
        assert found.sizes['skew_s'] == pytest.approx(1e-3, rel=0.05)


def test_all_channels_in_g_are_a_unit_and_not_a_level():
    """20 dB less of motion and of noise is a unit; 6 dB less of motion is an excitation."""
    samples, simulator = record(SECONDS)
    in_g = Samples(samples.values / GRAVITY, samples.rate_hz, samples.channels)
    found, = faults_of_spectra(cross_spectra(in_g, simulator))
    assert found.kind == 'unit'
    assert found.text.startswith('All channels are in g and not in m/s^2: 0.')
    assert found.sizes['factor'] == pytest.approx(1 / GRAVITY, rel=0.1)


def test_healthy_records_and_large_effects_are_no_faults():
    """Neither levels of 6 dB more or less nor large changes of the structure pass for wiring."""
    craft, rng = load_spacecraft(), np.random.default_rng(12)
    simulator = Simulator(craft, make_frame(int(SECONDS * 100), 100.0, SETTINGS), SECONDS)
    setups = [inject(at_levels(craft, 10 ** rng.uniform(-0.6, 0.6, 3)), (), SECONDS)
              for _ in range(12)]
    setups += [inject(craft, [parse_effect(t)], SECONDS) for t in (
        'stiffness_scale:scale=2', 'array_asymmetry:array=E2,scale=1.5',
        'sensor_gain:channel=e1_a,scale=3', 'channel_delay:channel=e1_b,delay_s=0.002',
        'sensor_misplacement:channel=e1_a,along_m=-2,lateral_m=0',
        'hinge_friction:array=E1,torque_n_m=0.05,stiffness_n_m_rad=1e5',
        'sensor_bandwidth:channel=all,corner_hz=10', 'excitation_colour:corner_hz=1.2',
        'quantisation:step_m_s2=0.01', 'quantisation:step_m_s2=0.2', 'saturation:limit_m_s2=0.03')]
    for seed, setup in enumerate(setups):
        samples = simulate_setup(setup, 300 + seed)
        assert faults_of_samples(samples) == ()
        assert faults_of_spectra(cross_spectra(samples, simulator)) == ()


def noisy(rng, count=60_000):
    """Return samples of four channels of filtered noise."""
    values = np.cumsum(rng.standard_normal((count, 4)), axis=0)
    return values[5:] - values[:-5]


def test_few_equal_neighbours_by_rounding_are_no_fault():
    """Forty pairs are equal by chance, and sixty in one record of ten."""
    rng = np.random.default_rng(6)
    for _ in range(100):
        values = np.rint(50 * noisy(rng, 8000)) / 50
        assert faults_of_samples(Samples(values, 100.0, ('a', 'b', 'c', 'd'))) == ()


@pytest.mark.parametrize('step', [0.0, 0.1])
def test_stuck_and_repeated_samples(step):
    """A channel that is stuck for a while, or repeats samples, rounded or not, is named."""
    rng = np.random.default_rng(5)
    values = noisy(rng)
    values = np.rint(values / step) * step if step else values
    names = ('a', 'b', 'c', 'd')
    assert faults_of_samples(Samples(values, 100.0, names)) == ()
    stuck = values.copy()
    stuck[20_000:21_000, 2] = stuck[20_000, 2]
    found, = faults_of_samples(Samples(stuck, 100.0, names))
    assert found.kind == 'stuck channel' and 'c is stuck at' in found.text
    assert 'for 10 s from 200 s' in found.text
    assert found.sizes['c'] == pytest.approx(10.0, abs=0.05)
    resent = values.copy()
    for row in np.flatnonzero(rng.random(len(values)) < 0.1)[1:]:
        resent[row, 1] = resent[row - 1, 1]
    found, = faults_of_samples(Samples(resent, 100.0, names))
    assert found.kind == 'repeated samples' and list(found.sizes) == ['b']
    assert found.sizes['b'] == pytest.approx(0.1, abs=0.02)
    held = values.copy()
    held[:, 3] = np.repeat(values[::4, 3], 4)[:len(values)]
    found, = faults_of_samples(Samples(held, 100.0, names))
    assert found.text == 'Channel d has a new sample only every 4 samples.'
    dead = values.copy()
    dead[:, 0] = 0.25
    found, = faults_of_samples(Samples(dead, 100.0, names))
    assert found.kind == 'stuck channel' and 'a is stuck at 0.25' in found.text


def test_few_rows_that_all_channels_repeat():
    """Rows resent where some were lost, in 3 of 10,000; none by rounding, of motion that turns."""
    rng = np.random.default_rng(4)
    t = np.arange(30_000) / 100.0
    motion = np.sin(2 * np.pi * 0.2 * t)[:, None] * [1.0, 0.7, -0.5]
    values = motion + 0.01 * rng.standard_normal(motion.shape)
    again = values.copy()
    rows = rng.choice(np.arange(1, len(t)), 9, replace=False)
    again[rows] = again[rows - 1]
    found, = faults_of_samples(Samples(again, 100.0, ('a', 'b', 'c')))
    assert found.kind == 'repeated samples' and set(found.sizes) == {'a', 'b', 'c'}
    assert '9 of 30000 rows' in found.text
    for healthy in (values, np.round(motion, 4), np.round(values, 3)):
        assert not faults_of_samples(Samples(healthy, 100.0, ('a', 'b', 'c')))
