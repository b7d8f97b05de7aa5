"""What a filter of modes makes of a spectrum is that of the structure that changed."""
import numpy as np
import pytest
from ssi_ros.gap.nominal.forms.local_change import from_frequencies, from_scores, local_change
from ssi_ros.gap.nominal.forms.mode_coupling import mixed_modes
from ssi_ros.gap.nominal.forms.structure import frequencies
from ssi_ros.gap.nominal.modal.fit import fit, ratio, residual_of, whitened
from ssi_ros.gap.nominal.modal.prediction import Averages, predict
from ssi_ros.gap.nominal.modal.reference import Modes, Nominal
from ssi_ros.gap.spectra.band_averages import plan
from ssi_ros.hermitian import filtered, whitened_alike
from ssi_ros.structural_modification import LocalChange, rank_one

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


PARTS = np.array([0.12, -0.1])      # of a place, at which a spring of 1 % of both modes gives


def test_a_local_change_is_the_inverse_of_the_changed_stiffness():
    """What all modes do beside one of them, at single frequencies, (147b)."""
    f, acts, reached = np.array([[4.8], [5.1], [5.4]]), np.array([0.02, -0.03]), np.array([1., 2.])
    found = LocalChange(f, F0, XI, 1).ratio(acts, reached)
    for at, row in zip(f.ravel(), found):
        stiffness = np.diag((F0 ** 2 - at ** 2 + 2j * XI * F0 * at) / F0 ** 2)
        exact = (np.linalg.inv(stiffness + np.outer(acts, reached)) @ stiffness)[:, 1]
        np.testing.assert_allclose([row[0], np.exp(row[1])], exact, rtol=1e-9)


def test_a_damper_turns_the_changed_stiffness():
    """A spring and a damper of one unit at 5 Hz, an eighth of a turn, (147b)."""
    f, acts, reached = np.array([[4.8], [5.1], [5.4]]), np.array([0.02, -0.03]), np.array([1., 2.])
    found = LocalChange(f, F0, XI, 1).ratio(acts, reached, np.pi / 4, 5.0)
    for at, row in zip(f.ravel(), found):
        stiffness = np.diag((F0 ** 2 - at ** 2 + 2j * XI * F0 * at) / F0 ** 2)
        added = np.outer(acts, reached) * (1 + 1j * at / 5.0) / np.sqrt(2)
        exact = (np.linalg.inv(stiffness + added) @ stiffness)[:, 1]
        np.testing.assert_allclose([row[0], np.exp(row[1])], exact, rtol=1e-9)


def test_a_spring_that_gives_moves_modes_and_turns_their_shapes():
    """The filter of the true numbers makes the spectrum of the structure that changed."""
    stiffness = np.eye(2) - np.outer(PARTS, PARTS)
    form = local_change(nominal(), -1.0, PARTS)
    mass = np.log(F0[1] / F0[0])                # of unit modal masses, and a spring
    first = int(np.argmax(np.abs(PARTS)))
    x = np.append(PARTS, [-mass if first == 0 else mass, 0.0])
    before, after = worst(form, x, stiffness)
    assert before > 8.0
    assert after < 2.0


@pytest.mark.parametrize('begin', ['scores', 'frequencies'])
def test_a_fit_finds_the_place_from_either_start(begin):
    """Parts of both modes, their signs too, from scores or from frequencies that moved."""
    there, stiffness = nominal(), np.eye(2) - np.outer(PARTS, PARTS)
    record = Averages(spectrum(stiffness), 30.0, 30.0)
    if begin == 'scores':
        residual, lower = residual_of(there, record)
        form = from_scores(there, there.spectrum, residual, lambda change: np.sqrt(
            record.weight) * whitened(change, lower))
    else:
        form = from_frequencies(there, np.diag(stiffness) - 1, [], lambda f: ratio(
            predict(there, (f,), np.append(np.zeros(2), f.start)), record, there.trust))
    found = fit(there, record, (form,), np.append(np.zeros(2), form.start), origin=np.zeros(2))
    parts = found.x[2:4] * np.sign(found.x[2])
    np.testing.assert_allclose(parts, PARTS, rtol=0.1)


def test_a_matrix_of_rank_one_is_found_where_some_scores_are_none():
    """Of a mode that no band holds nothing is known; of none at all, nothing."""
    u, v = np.array([0.02, -0.05, 0.0]), np.array([1.0, 0.5, 0.0])
    known = np.diag(np.outer([1, 1, 0], [1, 1, 0]).ravel().astype(float)).reshape(3, 3, 3, 3)
    acts, reached, gain = rank_one(np.outer(u, v), known)
    np.testing.assert_allclose(np.outer(acts, reached), np.outer(u, v), atol=1e-8)
    assert gain == pytest.approx(np.sum(np.outer(u, v) ** 2) / 2)
    assert not np.any(rank_one(np.zeros((3, 3)), np.zeros((3, 3, 3, 3)))[0])
