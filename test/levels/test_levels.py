"""Levels of inputs that differ each on its own are no evidence of anything else."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.modal.reference import identified
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.gap.spectra.band_averages import plan, spectra_of
from ssi_ros.levels.forces import bounded, force_spectra, turning
from ssi_ros.model import load_spacecraft

SECONDS = 300.0


def flown(seed, *effects, torque=(0.2, 0.1), process=1.0):
    """Return a record of the spacecraft under torque about x and y and process noise."""
    setup = inject(load_spacecraft(), [parse_effect(e) for e in effects], SECONDS)
    white, noise, *others = setup.system.excitation
    parts = (replace(white, rms=(*torque, 0.0)),
             replace(noise, rms=tuple(process * r for r in noise.rms)), *others)
    return simulate_setup(replace(setup, system=replace(setup.system, excitation=parts)), seed)


LOUDER = {'torque': (0.35, 0.06), 'process': 0.6}   # +4.9, -4.4 and -4.4 dB


@pytest.fixture(scope='module')
def pair():
    """Return the forces of a recording, and mean spectra of it and of one at other levels."""
    one, two = flown(1), flown(2, **LOUDER)
    cut = plan(len(one.values), one.rate_hz, 4)
    first, second = spectra_of(one.values, cut), spectra_of(two.values, cut)
    half = cut.width_hz / 2
    points = cut.middles_hz[:, None] + np.linspace(-half, half, 9)
    forces = force_spectra(identified(one.values, one.channels, one.rate_hz), points, first.mean,
                           first.freedom)
    return forces, first, second


def distance(model, spectrum):
    """Return tr W - log det W - 4 of a spectrum whitened by a model, mean of the bands."""
    ratio = np.linalg.solve(model, spectrum)
    return np.mean(np.einsum('bii->b', ratio).real - np.linalg.slogdet(ratio)[1] - 4)


def test_modes_under_forces_explain_a_recording_at_any_levels(pair):
    """A tenth more than chance at most; one level for all leaves a third more."""
    forces, first, second = pair
    chance = distance(forces.mean, first.mean)
    level = np.median(np.einsum('bii->b', np.linalg.solve(forces.mean, second.mean)).real / 4)
    after = forces.at_levels_of(second.mean, second.freedom, level)
    assert distance(after, second.mean) < 1.1 * chance
    assert distance(level * forces.mean, second.mean) > 1.3 * chance
    turned = turning(forces.mean, after)
    back = turned @ forces.mean @ turned.conj().swapaxes(-1, -2)
    np.testing.assert_allclose(back, after, rtol=1e-6, atol=1e-9 * np.abs(after).max())


def test_noise_of_a_channel_is_no_level(pair):
    """White noise on one channel is not in what levels change, a force on a mode is."""
    forces, first, _ = pair
    lower = np.linalg.inv(np.linalg.cholesky(forces.mean))
    basis = forces.basis(lower)
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-3)      # float32

    def outside(change):
        white = lower @ change @ lower.conj().swapaxes(-1, -2)
        row = (white.real + white.imag).ravel()
        return 1 - np.sum((basis @ row) ** 2) / (row @ row)
    noise = np.zeros_like(first.mean)
    noise[:, 1, 1] = 1.0
    assert outside(noise) > 0.05
    assert outside(forces.matrices[0].astype(complex)) < 1e-3


def test_bounded_keeps_what_is_inside_and_makes_spectra_of_the_rest():
    """Eigenvalues 0.2, 1 and -3 over another matrix become 0.5, 1 and 0.5."""
    usual = np.diag([1.0, 2.0, 3.0])[None] + 0j
    model = np.diag([0.2, 2.0, -9.0])[None] + 0j
    found = bounded(model, usual, 0.5, 2.0)[0]
    np.testing.assert_allclose(found, np.diag([0.5, 2.0, 1.5]), atol=1e-12)


@pytest.mark.slow
def test_levels_alone_are_within_the_floor():
    """Torques and process noise 4 to 5 dB up and down, each on its own."""
    assert diagnose(RecordedNominal(flown(23)), flown(24, **LOUDER)).outcome == 'WITHIN_FLOOR'


def test_a_gain_is_named_beside_levels_that_differ():
    """Channel e2_a times 1.06, its size within four of its own standard deviations."""
    found = diagnose(RecordedNominal(flown(5)),
                     flown(6, 'sensor_gain:channel=e2_a,scale=1.06', **LOUDER))
    assert found.verdict['effects'] == ('sensor_gain',)
    assert 'sensor_gain.channel.e2_a' in found.candidates[0].parameters
    value = found.candidates[0].parameters['sensor_gain.scale']
    assert abs(value.value - 1.06) < 4 * value.std


def test_too_large_a_structure_has_one_level():
    """No modes, or more entries than memory is worth: nothing is made."""
    spectrum = np.tile(np.eye(3, dtype=complex), (10, 1, 1))
    points = np.linspace(1.0, 9.0, 10)[:, None] + np.linspace(-0.4, 0.4, 9)
    assert force_spectra((), points, spectrum, 10.0) is None
    record = flown(7)
    modes = identified(record.values[:, :3], record.channels[:3], record.rate_hz)
    many = [replace(m, frequency_hz=m.frequency_hz * (1 + 1e-3 * k)) for m in modes
            for k in range(60)]
    assert force_spectra(many, points, np.tile(spectrum, (100, 1, 1)), 10.0) is None
