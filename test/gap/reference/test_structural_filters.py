"""What a filter of modes makes of a spectrum is that of the structure that changed."""
import numpy as np
from ssi_ros.gap.nominal.forms.mode_coupling import mixed_modes
from ssi_ros.gap.nominal.forms.structure import frequencies
from ssi_ros.gap.nominal.modal.reference import Modes, Nominal
from ssi_ros.gap.spectra.band_averages import plan
from ssi_ros.hermitian import filtered, whitened_alike

RATE_HZ = 50.0
F0, XI = np.array([5.0, 5.3]), np.array([0.02, 0.015])
SHAPES = np.linalg.qr(np.array([[1.0, 0.3], [0.4, 1.0], [0.7, -0.2]]))[0]
FORCE = np.array([[1.0, 0.99], [0.99, 1.0]])      # on both modes, mostly one and the same
CUT = plan(60000, RATE_HZ, 3)
POINTS = 31             # of a mean over a band


def spectrum(stiffness):
    """Return the spectrum of accelerations for a stiffness of both modes (2, 2), (b, 3, 3)."""
    half = (CUT.band_bins / 2 + 1) * CUT.resolution_hz
    f = (CUT.middles_hz[:, None] + np.linspace(-half, half, POINTS))[..., None, None]
    response = f ** 2 * np.linalg.inv(stiffness * np.outer(F0, F0) + 2j * f * np.diag(XI * F0)
                                      - f ** 2 * np.eye(2))
    motion = np.mean(response @ FORCE @ response.conj().swapaxes(-1, -2), axis=1)
    return SHAPES @ motion @ SHAPES.T + 1e-4 * np.eye(3)


def nominal():
    """Return the nominal of the structure as it was, its modes known."""
    return Nominal(CUT, spectrum(np.eye(2)), np.full(3, 1e-4), Modes(F0, XI, SHAPES, SHAPES),
                   np.ones(CUT.bands), ('a', 'b', 'c'), ())


def worst(form, x, stiffness):
    """Return the largest factor by which any direction near the modes is off, before and after."""
    there, now = nominal(), spectrum(stiffness)
    near = np.abs(CUT.middles_hz - F0.mean()) < 0.8
    off = []
    for mean in (there.spectrum, filtered(form.change(there, x)[0], there.spectrum)):
        sizes = np.linalg.eigvalsh(whitened_alike(mean, now)[near])
        off.append(np.exp(np.abs(np.log(sizes)).max()))
    return off


def test_modes_that_one_force_excites_move_with_their_phases():
    """All frequencies 2 % lower: the quiet direction of the spectrum follows, too."""
    form, x = next(iter(frequencies(nominal()))), np.array([np.log(0.96)])
    before, after = worst(form, x, 0.96 * np.eye(2))
    assert before > 40.0
    assert after < 3.0          # 22 where modes keep their phases


def test_modes_that_mix_do_so_too():
    """A spring between two modes turns their motion, phases with it."""
    stiffness = np.array([[0.96, 0.03], [0.03, 1.0]])
    sizes, turn = np.linalg.eigh(stiffness * np.outer(F0, F0))
    there = Modes(np.sqrt(sizes), XI, SHAPES @ turn, SHAPES @ turn)
    x = np.array([np.log(0.96), 0.0, 0.03, 0.0, 0.0])
    before, after = worst(mixed_modes(nominal(), there), x, stiffness)
    assert before > 40.0
    assert after < 3.0
