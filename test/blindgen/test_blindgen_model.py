"""The second model of the spacecraft: published tables, laws of the integrator and the chain."""
from dataclasses import replace

from blindgen import record
from blindgen.craft import assemble, frequencies, propagators, state_matrices
from blindgen.detect import _probes, _scores
from blindgen.plate import clamped_modes, Plate
from blindgen.record import simulate
from blindgen.scenario import Scenario
from blindgen.sensors import measured
from blindgen.spectrum import GRID_BINS, spectrum, transfer
import numpy as np
import pytest
from scipy.linalg import expm

# Hz, pairs (symmetric, antisymmetric), from a conforming finite-element plate (ours)
TABLE_HZ = [0.361, 0.693, 2.260, 2.437, 2.918, 2.982, 6.345, 6.445, 9.009, 9.033, 12.484, 12.557,
            15.828, 15.844, 20.707, 20.767, 23.768, 23.782, 30.978, 31.030]
NOMINAL = Scenario()
FREEPLAY = replace(NOMINAL, hinge=(1e6, np.inf),
                   local=(('freeplay', 0, {'at': 'hinge', 'values': (1e6, 2e-7)}),))


@pytest.fixture
def short(monkeypatch):
    """Shorten the settling: these tests compare records, they need no stationarity."""
    monkeypatch.setattr(record, 'SETTLE_S', 10.0)
    monkeypatch.setattr(record, 'LEAD_S', 5.0)


def test_square_plate_lies_under_bartons_ritz_values():
    """A finer Ritz space gives lower frequencies: at most 1 % under Barton 1951, never above."""
    omega = clamped_modes(Plate(1.0, 1.0, 1.0, 1.0, 0.3), 6).omega
    ratio = omega / [3.492, 8.525, 21.43, 27.33, 31.11, 54.44]
    assert np.all(ratio < 1) and np.all(ratio > 0.99)


def test_frequencies_of_the_coupled_spacecraft():
    """Two formulations agree: 0.3 % is the bound agreed on, three times the difference seen."""
    own, damping = frequencies(assemble(replace(NOMINAL, own_mesh=True)))
    assert np.allclose(own, TABLE_HZ, rtol=3e-3)
    # symmetric bending leaves the hub at rest, so its damping is that of the clamped array
    assert damping[0] == pytest.approx(0.005, rel=1e-6)
    # the tested frequencies are within the table's last digit, 0.0005 Hz, and rounding of pairs
    assert np.allclose(frequencies(assemble(NOMINAL))[0], TABLE_HZ, atol=0.0011)


def test_a_stiff_hinge_is_a_clamp():
    """The hinge is nested in the nominal model: its frequency change falls as 1 / stiffness."""
    clamp = frequencies(assemble(NOMINAL))[0]
    # the last mode of a hinge, far above, is the 21st
    hinged = [frequencies(assemble(replace(NOMINAL, hinge=(k, np.inf))))[0][:20]
              for k in (1e7, 1e8)]
    change = [np.abs(f - clamp).max() for f in hinged]
    # 20 % covers the second order of the change
    assert change[1] == pytest.approx(change[0] / 10, rel=0.2)


@pytest.mark.parametrize('step_s', [0.01, 0.0005])
def test_propagators(step_s):
    """Series and doubling agree with the exponential of an augmented matrix."""
    a = state_matrices(assemble(NOMINAL))[0]
    n = len(a)
    big = np.zeros((3 * n, 3 * n))
    big[:n, :n], big[:n, n:2 * n] = a * step_s, np.eye(n)
    big[n:2 * n, 2 * n:] = np.eye(n)
    exact = expm(big)
    e, p0, p1 = propagators(a, step_s)
    # entries reach 200; 1e-9 is rounding
    assert np.allclose(e, exact[:n, :n], atol=1e-9)
    assert np.allclose(p1, step_s * exact[:n, 2 * n:], atol=1e-9)
    assert np.allclose(p0 + p1, step_s * exact[:n, n:2 * n], atol=1e-9)


def test_the_linear_part_is_exact_at_any_step(short):
    """100 Hz and 2 kHz give one record: rounding only."""
    coarse, fine = (simulate(NOMINAL, 20, 1, substeps=n)[0] for n in (1, 20))
    assert np.abs(coarse - fine).max() < 1e-10


def test_2_khz_is_enough_for_freeplay(short):
    """Halving the step changes a rattling record by less than 1 % of what freeplay changes."""
    none, khz2, khz4 = (simulate(s, 20, 1, substeps=n)[0]
                        for s, n in ((replace(FREEPLAY, local=()), 20), (FREEPLAY, 20),
                                     (FREEPLAY, 40)))
    assert np.std(khz2 - khz4) < 0.01 * np.std(khz2 - none)


@pytest.mark.parametrize('law, values', [('friction', (0.1,)), ('quadratic', (100.0,)),
                                         ('slider', (3e3, 0.02)), ('bouc_wen', (5e5, 1e-7))])
def test_dissipative_laws_take_energy(short, law, values):
    """No passive law adds energy: a free vibration is never larger with it than without."""
    at = 'hinge' if law in ('friction', 'bouc_wen') else 1.0 if law == 'slider' else 8.0
    base = replace(NOMINAL, hinge=(1e6, np.inf), level=1.0)
    with_law = replace(base, local=(('none', 0, {'at': at, 'values': values}),))
    n = len(assemble(base).mass)
    kick = np.zeros(2 * n)
    kick[n + 3] = 1e-2
    u, smooth = np.zeros((3000, 22)), np.zeros(3000 * 20 + 1)
    ends = []
    for kind in (0, record.LAWS[law]):
        x = kick.copy()
        record.march(*record._blocks(with_law, 20, [0.0]),
                     *record._laws(with_law, np.array([0, kind])), x, u, smooth, 1 / 2000, 3000)
        craft = assemble(base)
        ends.append(x[n:] @ craft.mass @ x[n:] + x[:n] @ craft.stiffness @ x[:n])
    assert ends[1] < ends[0]


def test_records_and_spectrum_agree_as_far_as_a_record_can_tell():
    """Scores of levels, stiffness and damping are zero-mean over records without effect."""
    w, f = _probes()
    expected = np.einsum('k,pkij,kji->p', GRID_BINS, w, sum(spectrum(NOMINAL))).real
    scores = np.array([_scores(NOMINAL, 600.0, k, w) for k in range(4)]) - expected
    standard = scores.mean(axis=0) / np.sqrt(np.diag(f))
    # sd of one score is 1.39 under the taper, of the mean of four 0.7: four sd. A frequency that
    # is 0.03 % off would be at 3 in one array alone.
    assert np.all(np.abs(standard) < 2.8), standard


def test_torque_about_x_reaches_antisymmetric_motion_alone():
    """Without process noise the two arrays move against each other, to rounding."""
    g = transfer(NOMINAL)[:, :, 0]
    assert np.abs(g[:, 0] + g[:, 2]).max() < 1e-9 * np.abs(g).max()


def test_a_delay_is_a_shift_of_the_band_limited_signal(rng):
    """A 10 Hz sine read 0.4 ms late; 1e-6 is what 32 sinc taps leave."""
    t = np.arange(1400) / 100
    y = np.repeat(np.sin(2 * np.pi * 10 * t)[:, None], 4, axis=1)
    late = replace(NOMINAL, delays=((1, 4e-4),), noise_level=0.0)
    got, index = measured(late, y, 200, 1000, rng)
    want = np.sin(2 * np.pi * 10 * (t[200:1200] - 4e-4))
    assert np.abs(got[:, 1] - want).max() < 1e-6
    assert np.abs(got[:, 0] - y[200:1200, 0]).max() < 1e-12
    assert np.array_equal(index, np.arange(1000))


def test_a_record_shorter_than_a_second_is_refused():
    """The message says what was given and what to do."""
    with pytest.raises(ValueError, match='duration_s=0.5 is under 1 s'):
        simulate(NOMINAL, 0.5, 0)


def test_a_slow_clock_keeps_the_power_up_to_50_hz(rng):
    """
    Other instants of a band-limited signal have its spectrum: nothing is lost near 50 Hz.

    5 % are four standard deviations of the power of white noise in the uppermost 1.5 Hz.
    """
    y = rng.standard_normal((40200, 4))
    y[:, 1:] = y[:, :1]
    got = measured(replace(NOMINAL, ppm=50.0, noise_level=0.0), y, 200, 39500, rng)[0][:, 0]
    f = np.fft.rfftfreq(39500, 0.01)
    top = f > 48.5
    power = [np.mean(np.abs(np.fft.rfft(x))[top]**2) for x in (got, y[200:39700, 0])]
    assert power[0] == pytest.approx(power[1], rel=0.05)
