"""What must not be called a mode: noise-free chains, periodic excitation, weak distortion."""
from dataclasses import replace
import os
from pathlib import Path

import numpy as np
import pytest
from ssi_ros.identify import Identification, identify
from ssi_ros.identify.explain import explain
from ssi_ros.identify.harmonics import label, look
from ssi_ros.identify.modes import Candidate, unbelievable
from ssi_ros.model import simulate
from ssi_ros.model.three_dof import excitation_of, three_dof
from ssi_ros.records import Samples

DATA = Path(os.environ.get('SSI_ROS_DATA',
                           Path(__file__).resolve().parents[2].parent / 'shared' / 'data'))
GOOD = Candidate(12.0, 0.005, np.ones(2), 0.01, 0.0005, 8, 0, np.zeros(2), 0.1)


def measured(name):
    """Return the path of a measured record, or skip."""
    if not (DATA / name).exists():
        pytest.skip(f'{name} is not at hand: set SSI_ROS_DATA to the folder that holds it')
    return DATA / name


@pytest.mark.parametrize('change, word', [
    ({}, ''),
    ({'damping_ratio': -0.003}, 'negative beyond its spread'),
    ({'damping_ratio': -1e-5, 'damping_ratio_std': 1e-7}, ''),      # a line, but for rounding
    ({'damping_ratio': -0.005, 'damping_ratio_std': 0.013}, 'was not measured'),
    ({'damping_ratio': 0.03, 'damping_ratio_std': 0.012}, ''),
    ({'damping_ratio': 0.001, 'damping_ratio_std': 0.004}, 'was not measured'),     # 1440 cycles
    ({'frequency_std_hz': 0.3}, 'spread over more than 1 %'),
    ({'share': 2e-6}, '2e-06 of the power'),
    ({'share': 2e-6, 'damping_ratio': 1e-6}, ''),                   # a weak line is still a line
])
def test_why_a_candidate_is_left_out(change, word):
    """Every rule has a case that it stops and one beside it that it lets through."""
    reason = unbelievable(replace(GOOD, **change), 120.0)
    assert word in reason and bool(word) == bool(reason)


@pytest.mark.parametrize('case, seconds', [
    ('white', 600.0), ('white', 120.0), ('white_and_sine', 600.0), ('white_and_sine', 120.0)])
@pytest.mark.parametrize('seed', [1, 2, 3, 4])
def test_one_channel_of_a_chain_has_its_three_modes(case, seconds, seed):
    """One nearly noise-free channel: three modes, the line, and nothing else."""
    samples = simulate(three_dof(), seconds, seed, excitation=excitation_of(case), at_rest=True)
    window = identify(samples, Identification(window_s=seconds, hop_s=seconds / 60))[-1]
    found = [m.frequency_hz for m in window.modes if m.label == 'structural']
    # five spreads of the shorter record
    np.testing.assert_allclose(found, [7.0831, 19.8462, 28.6787], rtol=5e-3)
    rest = [(m.frequency_hz, m.label) for m in window.modes if m.label != 'structural']
    if case == 'white':
        assert rest == []
    else:
        assert rest == [(pytest.approx(12.0, abs=0.005), 'input_line')]


def test_lines_of_a_periodic_excitation_are_no_machines():
    """A multisine of 10 s through a mode of 2 %: in 200 s every line stands alone, and yet."""
    rng = np.random.default_rng(2)
    t = np.arange(20000) / 100.0
    mode = replace(GOOD, frequency_hz=8.0, damping_ratio=0.02)
    f = np.arange(2.0, 15.0, 0.1)
    gain = 1.0 / np.abs(8.0 ** 2 - f ** 2 + 2j * 0.02 * 8.0 * f)
    rows = (gain * np.cos(2.0 * np.pi * (np.outer(t, f) + rng.random(len(f))))).sum(axis=1)
    alone = np.cos(2.0 * np.pi * 8.0 * t) + 0.1 * rng.standard_normal(len(t))
    for values, comb, word in ((rows, True, 'structural'), (alone, False, 'input_line')):
        peaks = look(values[:, None], 100.0, [8.0])
        assert peaks.comb[0] == comb
        assert label(mode, peaks.sharpness[0], 200.0, peaks.comb[0],
                     peaks.change[0])[0] == word


def test_a_free_decay_is_no_machine():
    """A ringing that dies in the window is sharper than its damping, and is not running."""
    t = np.arange(6000) / 100.0
    values = np.exp(-0.2 * t) * np.cos(2.0 * np.pi * 7.0 * t)
    peaks = look(values[:, None], 100.0, [7.0])
    word, note = label(replace(GOOD, frequency_hz=7.0, damping_ratio=0.0045), 900.0, 60.0,
                       peaks.comb[0], peaks.change[0])
    assert word == 'undecided' and 'free decay' in note


def test_f16_at_low_level():
    """
    A multisine of 2 to 15 Hz on an aircraft: its modes, the mains, and no trust above 15 Hz.

    Noel and Schoukens 2017, level 1; 4e-5 of the energy lies outside of 2 to 15 Hz.
    """
    data = np.load(measured('f16_level1.npz'))
    samples = Samples(data['acceleration'], float(data['rate_hz']), ('a', 'b', 'c'))
    for window in identify(samples, Identification(window_s=60.0, hop_s=10.0)):
        modes = [m.frequency_hz for m in window.modes if m.label == 'structural']
        assert max(modes) < 15.0, explain(window, max(modes))
        # the wing's bending and torsion, and the mode above them, as peaks of the spectrum
        for f in (5.2, 7.35, 9.18):
            assert min(abs(np.array(modes) / f - 1.0)) < 0.01
        others = [m for m in window.modes if m.label != 'structural']
        assert all(m.label == 'input_line' for m in others if m.frequency_hz > 15.0)
        assert all(abs(m.frequency_hz - 150.0) < 0.1 for m in others if m.label == 'input_line')


def test_bridge_of_another_author():
    """E. Cheynet's bridge: six modes and nothing else, near the rates that its step rule gives."""
    from scipy.io import loadmat
    data = loadmat(measured('BridgeData.mat'))
    rows = np.asarray(data['rz'], float)
    samples = Samples(rows if len(rows) > rows.shape[1] else rows.T, 15.0, tuple('abcde'))
    window = identify(samples, Identification(window_s=3600.0, hop_s=3600.0))[0]
    rule = 2.0 * 15.0 * np.arctan(np.sort(np.ravel(data['wn'])) / (2.0 * 15.0)) / (2.0 * np.pi)
    # an hour holds 740 cycles of the slowest, whose frequency is then known to 0.1 %
    np.testing.assert_allclose([m.frequency_hz for m in window.modes], rule, rtol=4e-3)
    assert all(0.003 < m.damping_ratio < 0.008 for m in window.modes)     # 0.5 % was put in
