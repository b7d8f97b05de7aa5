"""Models of other people: three forms, one system; and one sentence for each way to be wrong."""
from dataclasses import replace
from pathlib import Path
import runpy

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.linalg import expm

from ssi_ros.model import (
    assemble, Channel, Input, LinearModel, load_spacecraft, modal_model, natural_modes, simulate,
    state_space_model)
from ssi_ros.model.spectrum import output_spectrum

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'
FREQUENCIES_HZ = np.linspace(0.05, 9.9, 200)


@pytest.fixture(scope='module')
def building():
    """Return the shear building of the examples."""
    return runpy.run_path(EXAMPLES / 'shear_building.py')['shear_building']()


def test_the_periods_of_the_textbook(building):
    """Chopra, Dynamics of Structures, section 12.8: a five-storey frame."""
    modes = natural_modes(assemble(building))
    # the last digit of the printed periods
    np.testing.assert_allclose(1 / modes.frequencies_hz,
                               [2.0, 0.6852, 0.4346, 0.3383, 0.2966], rtol=5e-4)
    np.testing.assert_allclose(modes.damping_ratios, 0.02, rtol=1e-6)


def test_kinds_are_derivatives(building):
    """The displacement of the roof times (j omega)^2 is its acceleration."""
    channels = tuple(replace(building.sensors[3], name=k, kind=k)
                     for k in ('displacement', 'velocity', 'acceleration', 'strain'))
    model = replace(building, sensors=channels, output=building.output[[3, 3, 3, 3]])
    h = assemble(model).transfer(FREQUENCIES_HZ)
    s = 2j * np.pi * FREQUENCIES_HZ[:, None]
    np.testing.assert_allclose(h[:, 1], s * h[:, 0], rtol=1e-7)
    np.testing.assert_allclose(h[:, 2], s ** 2 * h[:, 0], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(h[:, 3], h[:, 0], rtol=1e-9)


@pytest.mark.parametrize('discrete', [False, True])
def test_a_state_space_is_the_same_system(building, discrete):
    """Matrices, their continuous and their sampled state space have one transfer function."""
    system = assemble(building)
    a, b, c, d = (getattr(system.plant, n) for n in 'abcd')
    if discrete:
        n, m = b.shape
        both = expm(np.block([[a, b], [np.zeros((m, n + m))]]) / building.rate_hz)
        a, b = both[:n, :n], both[:n, n:]
    model = state_space_model(a, b, c, d, discrete=discrete, rate_hz=building.rate_hz,
                              drives=building.drives, sensors=building.sensors)
    for rate_hz in (None, 20.0, 33.0):
        np.testing.assert_allclose(
            assemble(model).transfer(FREQUENCIES_HZ, rate_hz),
            system.transfer(FREQUENCIES_HZ, rate_hz), rtol=1e-6, atol=1e-15)


def test_modes_are_the_same_system(building):
    """The modal model of mass-normalised shapes has the spectrum of the matrices."""
    from scipy.linalg import eigh
    squares, shapes = eigh(building.stiffness, building.mass)
    model = modal_model(np.sqrt(squares) / (2 * np.pi), 0.02, building.output @ shapes,
                        shapes.T @ building.input, drives=building.drives,
                        sensors=building.sensors, rate_hz=building.rate_hz)
    np.testing.assert_allclose(*(output_spectrum(assemble(m), FREQUENCIES_HZ)
                                 for m in (model, building)), rtol=1e-6, atol=1e-18)


def test_a_record_has_the_expected_spectrum(building):
    """Levels are rms at the rate of the model; displacements and accelerations in one record."""
    system = assemble(building)
    values = np.concatenate([simulate(system, 3000.0, seed).values for seed in (1, 2)])
    f = np.linspace(0.005, 9.995, 4000)
    power = 2 * trapezoid(np.einsum('fii->fi', output_spectrum(system, f)).real, f, axis=0)
    # 6000 s hold 380 independent energies of the first mode: 5 % of variance, 2.6 % of rms
    np.testing.assert_allclose(values.std(axis=0), np.sqrt(power), rtol=0.08)


def test_a_free_body_is_measured_by_accelerations(building):
    """A chain that nothing holds has all its modes but one; its displacement is refused."""
    stiffness = building.stiffness.copy()
    stiffness[0, 0] /= 2
    free = replace(building, stiffness=stiffness, damping=0.01 * stiffness,
                   output=building.output[:3], sensors=building.sensors[:3])
    modes = natural_modes(assemble(free)).frequencies_hz
    count = len(building.freedoms)
    exact = [np.sqrt(5.523e6 / 45_359) / np.pi * np.sin(k * np.pi / (2 * count))
             for k in range(1, count)]
    np.testing.assert_allclose(modes, exact, rtol=1e-4)
    assert free.vibrating == count - 1
    with pytest.raises(ValueError, match='gnss reads the displacement of a motion that no spring'):
        replace(free, output=building.output, sensors=building.sensors)


def test_one_channel_and_a_coloured_input():
    """The smallest model; the excitation has the colour and a level of its own."""
    model = modal_model([2.0], 0.01, [[1.0]], [[1.0]], rate_hz=25.0,
                        drives=(Input('push', 3.0, corner_hz=1.0),),
                        sensors=(Channel('top', 'velocity', 1e-3),))
    (part,) = assemble(model).excitation
    assert part.corner_hz == 1.0 and part.part.held_rms(25.0) == pytest.approx(3.0)
    (louder,) = assemble(model.at_levels([4.0, 9.0])).excitation
    assert louder.part.held_rms(25.0) == pytest.approx(6.0)
    assert model.at_levels([4.0, 9.0]).sensors[0].noise_rms == pytest.approx(3e-3)


def test_models_that_are_the_same_are_equal(building):
    """Caches hold models by value; another number makes another model."""
    again = replace(building)
    assert again == building and hash(again) == hash(building) and repr(again) == repr(building)
    other = replace(building, mass=building.mass * 1.001)
    assert other != building and repr(other) != repr(building)
    assert building != load_spacecraft()


NAMES = {'freedoms': ('a', 'b'), 'drives': (Input('u', 1.0),), 'sensors': (Channel('y'),),
         'rate_hz': 20.0}
GIVEN = {'mass': np.eye(2), 'damping': np.eye(2), 'stiffness': [[200.0, -100.0], [-100.0, 100.0]],
         'input': [[0.0], [1.0]], 'output': [[0.0, 1.0]]}


@pytest.mark.parametrize('change, words', [
    ({'mass': np.eye(3)}, r'mass has the shape \(3, 3\), but 2 freedoms need \(2, 2\)'),
    ({'output': [[1.0]]}, r'output has the shape \(1, 1\), but 1 channels and 2 freedoms need'),
    ({'stiffness': [[2.0, -1.0], [0.0, 1.0]]}, 'stiffness is not symmetric: 0 in|-1 in row 1'),
    ({'stiffness': [[1.0, 2.0], [2.0, 1.0]]}, 'stiffness is indefinite: it has the eigenvalue -1'),
    ({'damping': -np.eye(2)}, 'damping is indefinite'),
    ({'stiffness': np.zeros((2, 2))}, 'stiffness is all zero'),
    ({'mass': np.diag([1.0, 0.0])}, 'mass is not positive definite.*condense'),
    ({'mass': [[1.0, 0.0], [0.0, np.nan]]}, 'mass holds values that are not finite'),
    ({'damping': np.zeros((2, 2))}, 'does not decay.*give it damping'),
    ({'rate_hz': 3.0}, 'rate_hz=3 is too low: the highest mode.*raise rate_hz above'),
    ({'rate_hz': 0.0}, 'rate_hz=0 must be a positive number'),
    ({'freedoms': ('a', 'a')}, 'freedoms have the names .*each with its own name'),
    ({'freedoms': ('a', 'ground')}, "'ground', which stands for what does not move"),
    ({'drives': (Input('u', 0.0),)}, 'no input has a level above zero')])
def test_what_is_wrong_is_said(change, words):
    """One sentence: what was given, what is allowed, what to do."""
    LinearModel(**GIVEN, **NAMES)
    with pytest.raises(ValueError, match=words):
        LinearModel(**{**GIVEN, **NAMES, **change})


@pytest.mark.parametrize('a, discrete, words', [
    (np.diag([0.5, 1.01]), True, 'not stable.*inside the unit circle'),
    ([[0.0, 1.0], [-4.0, 0.1]], False, 'not stable.*negative real part'),
    (np.diag([0.5, 0.4]), True, 'no mode that vibrates'),
    ([[0.5, 1.0], [0.0, 0.5]], True, 'not independent'),
    (np.diag([0.5, -0.4]), True, 'alternates from sample to sample'),
    (np.eye(3), True, r'a, b, c, d have the shapes \(3, 3\)')])
def test_a_state_space_that_is_wrong_is_refused(a, discrete, words):
    """Unstable, defective, without modes, or of no continuous system."""
    with pytest.raises(ValueError, match=words):
        state_space_model(a, [[1.0], [1.0]], [[1.0, 1.0]], [[0.0]], discrete=discrete,
                          rate_hz=10.0, drives=NAMES['drives'], sensors=NAMES['sensors'])
