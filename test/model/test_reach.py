"""Reach and placement: what can be known, against formulas and against records."""
from dataclasses import replace
import math

import numpy as np
import pytest
from ssi_ros.model import assemble, Spacecraft
from ssi_ros.model.information import information, modal_view, spreads
from ssi_ros.model.placement import effective_independence, particle_swarm, present, Scene
from ssi_ros.model.reach import reach
from ssi_ros.model.spectrum import output_spectrum

ODD_BENDING = [2, 4, 8, 12, 16, 20]     # opposite bending: the modes with H_x, counted from 1


@pytest.fixture(scope='module')
def system():
    """Return the default system."""
    return assemble(Spacecraft())


def test_torque_about_x_reaches_six(system):
    """Symmetry: only opposite bending has angular momentum about x_b."""
    found = reach(system, system.excitation[:1])
    assert [i + 1 for i, m in enumerate(found) if m.verdict == 'reached'] == ODD_BENDING
    rest = [m for i, m in enumerate(found) if i + 1 not in ODD_BENDING]
    assert all(m.verdict == 'not excited' and m.frequency_s == math.inf for m in rest)


def test_process_noise_reaches_all(system):
    """Every modal coordinate is driven, every shape is seen."""
    assert all(m.verdict == 'reached' for m in reach(system))


def test_no_excitation_reaches_nothing(system):
    """Nothing is invented where nothing acts."""
    assert all(m.verdict == 'not excited' for m in reach(system, ()))


def test_a_bad_sensor_sees_nothing(system):
    """With noise of 1 m/s^2 the quiet modes are excited but not seen."""
    noisy = replace(Spacecraft(), noise_rms_m_s2=1.0)
    verdicts = {m.verdict for m in reach(assemble(noisy))}
    assert 'not seen' in verdicts and 'not excited' not in verdicts


def test_lengths_are_those_of_one_mode_alone(system):
    """Lone modes follow xi / (2 pi f 1e-6); 20 % covers neighbours, noise and direct torque."""
    for m in reach(system):
        alone = m.damping_ratio / (2 * np.pi * m.frequency_hz * 1e-6)
        assert m.frequency_s == pytest.approx(alone, rel=0.2)


def test_information_equals_its_definition(system):
    """Against eq. (32) with the spectrum of `spectrum.py` differenced by hand, to 2 %."""
    mode, step = 3, 1e-5
    view = modal_view(system)
    noise = np.full(4, 3e-4)
    info = information(view, system.sensor, noise, [mode], points=61)

    def density(f, change):
        # moving one frequency: the pole of that mode moves, its residue stays
        poles = view.eigenvalues.copy()
        poles[mode] *= 1 + change
        mu, z = np.exp(poles / 100.0), np.exp(2j * np.pi * f / 100.0)
        c = system.sensor @ view.motion
        h = ((c / (z[:, None, None] - mu)) @ view.drive
             + (c.conj() / (z[:, None, None] - mu.conj())) @ view.drive.conj()
             + system.sensor @ view.direct)
        return h @ h.conj().swapaxes(1, 2) + np.diag(noise ** 2)
    f0 = view.frequencies_hz[mode]
    f = np.linspace(f0 - 1.0, f0 + 1.0, 6001)
    s = density(f, 0.0)
    assert s / 100.0 == pytest.approx(output_spectrum(system, f), rel=1e-6, abs=1e-16)
    slope = (density(f, step) - density(f, -step)) / (2 * step)
    q = np.linalg.solve(s, slope)
    by_hand = np.sum(np.einsum('fij,fji->f', q, q).real) * (f[1] - f[0])
    assert info[0, 0] == pytest.approx(by_hand, rel=0.02)


def test_more_unknowns_never_help(system):
    """Bounds with all modes unknown are at least those with one unknown."""
    view, noise = modal_view(system), np.full(4, 3e-4)
    whole, _ = spreads(information(view, system.sensor, noise), 20)
    for mode in (0, 5, 13):
        alone, _ = spreads(information(view, system.sensor, noise, [mode]), 1)
        assert whole[mode] >= alone[0] * (1 - 1e-9)


@pytest.fixture(scope='module')
def scene():
    """Return the default spacecraft under its torque alone."""
    craft = Spacecraft()
    craft = replace(craft, excitation=replace(craft.excitation, process_noise_rms=0.0))
    return Scene(craft, assemble(craft))


def test_swarm_is_seeded_and_never_worse_than_its_start(scene):
    """Twice the same seed is twice the same layout, at least as good as where it began."""
    start = (present(scene), effective_independence(scene, 4))
    one = particle_swarm(scene, 4, 3, particles=6, rounds=4, start=start)
    assert one == particle_swarm(scene, 4, 3, particles=6, rounds=4, start=start)
    assert one.gain >= max(s.gain for s in start) * (1 - 1e-6)   # 1e-6: the tip is mapped inward


def test_effective_independence_beats_a_bad_layout(scene):
    """Four sensors where the shapes are known beat four at one root by far."""
    best = effective_independence(scene, 4)
    poor = [('E1', 0.01, x) for x in (-0.9, -0.3, 0.3, 0.9)]
    assert len(best.places) == 4 and best.score > scene.score(poor)
    more = effective_independence(scene, 8)
    assert more.score > best.score


def test_bad_requests_are_refused(scene):
    """Modes that nothing excites, or that do not exist, and impossible numbers of sensors."""
    with pytest.raises(ValueError, match=r'modes \[1\] are not excited'):
        Scene(scene.spacecraft, assemble(scene.spacecraft), [0])
    with pytest.raises(ValueError, match='mode 21 is beyond'):
        Scene(scene.spacecraft, assemble(scene.spacecraft), [20])
    with pytest.raises(ValueError, match='count=0'):
        particle_swarm(scene, 0)
    with pytest.raises(ValueError, match='count=1000'):
        effective_independence(scene, 1000)
