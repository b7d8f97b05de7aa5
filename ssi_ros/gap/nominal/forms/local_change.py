"""
A local change of the structure: one spring or mass more or less, of rank one in the modes, (147b).

It moves every mode by the square of what the mode has of the place, and turns the shapes of all
of them by the same numbers: neither a moved sensor nor frequencies that change alone do that.
"""
from functools import lru_cache

import numpy as np
from scipy.special import betainc

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import showing
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.forms.sensor import at_mode
from ssi_ros.gap.nominal.modal.reference import around, reach_hz
from ssi_ros.identify.shapes import mac
from ssi_ros.structural_modification import LocalChange, rank_one

POINTS = 9              # at which a resonance is averaged over a band
MOST_MASS = 6.0         # logarithm of one modal mass over another
LEAST_PART = 1e-3       # root of a relative change of stiffness at which a fit begins
MOST_ROWS = 5_000_000   # numbers of all scores that a start is sought by; bands are left out
BY_CHANCE = 0.05        # of a MAC of parts and shapes: the place does not move as a channel does


def local_change(nominal, sign, parts, masses=0.0):
    """
    Return the form of one local change that lowers (sign -1) or raises (1) frequencies.

    It begins at `parts` (m,), roots of the relative changes of modal stiffness with the signs of
    the modes at the place, and `masses` (m,), logarithms of modal masses over that of the mode
    that changes most, times the cube of the ratio of frequencies: between a spring and a mass.
    """
    modes, cut, count = nominal.modes, nominal.cut, len(nominal.modes)
    first, near = int(np.argmax(np.abs(parts))), _near(modes, cut)
    others = np.flatnonzero(np.arange(count) != first)
    usual = 3 * np.log(modes.frequencies_hz / modes.frequencies_hz[first])

    def change(_, x):
        part, mass = np.array(x[:count]), usual.copy()
        mass[others] += x[count:]
        acts, reached = sign * part * np.exp(-mass / 2), part * np.exp(mass / 2)
        gain = np.tile(np.eye(len(nominal.channels), dtype=complex), (cut.bands, 1, 1))
        for k, (bands, window, both) in enumerate(near):
            ratio = both.ratio(acts, reached)
            own = np.exp(window[:, 0] * ratio[:, k]) - 1
            ratio *= window
            ratio[:, k] = own
            gain[bands] += (ratio @ modes.shapes.T)[..., None] * modes.duals[:, k].conj()
        return gain, None
    at = [at_mode(f) for f in modes.frequencies_hz]
    numbers = [Number(f'scale_{n}', '1', 0.01, -1.0, 1.0, lambda x: 1 + sign * x ** 2) for n in at]
    numbers += [Number(f'modal_mass_{at[i]}', '1', 0.1, -MOST_MASS, MOST_MASS, np.exp)
                for i in others]
    masses = np.clip(masses + np.zeros(count), -MOST_MASS / 3, MOST_MASS / 3)
    return Form({'modes': 'local'}, tuple(numbers), change,
                'one spring or mass changed: modes moved and their shapes turned',
                ModalPattern.MODE_FREQUENCIES, showing(ModalPattern.COMMON_FREQUENCY_RATIO)[0],
                begin=np.append(parts, masses[others]),
                near=lambda x: _nearest(nominal, x[:count]))


def _nearest(nominal, parts):
    """Return the channel that moves as the place does and the MAC of it, {} if none does."""
    # modal masses are not known: of all modes about the same. A spring acts by displacements
    of_either = np.array([parts, parts * nominal.modes.frequencies_hz])
    alike = mac(of_either, nominal.modes.shapes.real).max(axis=0)
    best = int(np.argmax(alike))
    # of a random direction it has a beta distribution
    clear = 2 * len(alike) * betainc((len(parts) - 1) / 2, 0.5, 1 - alike[best]) < BY_CHANCE
    return {nominal.channels[best]: float(alike[best])} if clear else {}


def from_scores(nominal, spectrum, residual, white):
    """
    Return the form begun where a whitened residual (n,) around a spectrum (b, l, l) leads.

    `white` whitens a change of the spectrum (b, l, l), (n,).
    """
    modes, cut, count, total = nominal.modes, nominal.cut, len(nominal.modes), nominal.cut.bands
    step = 1 + count ** 2 * len(residual) // MOST_ROWS
    residual = residual.reshape(total, -1)[::step].ravel()
    rows = np.zeros((count, count, len(residual)))
    for k, (bands, window, both) in enumerate(_near(modes, cut)):
        response = (both.weight[:, None] @ both.response)[:, 0]
        for i in range(count):
            turn = np.outer(modes.shapes[:, i], modes.duals[:, k].conj())
            part = (-window * response[:, i:i + 1])[..., None] * (turn @ spectrum[bands])
            change = np.zeros_like(spectrum)
            change[bands] = part + part.conj().swapaxes(-1, -2)
            rows[i, k] = white(change).reshape(total, -1)[::step].ravel()
    flat = rows.reshape(count ** 2, -1)
    acts, reached, _ = rank_one(rows @ residual, (flat @ flat.T).reshape((count,) * 4))
    moved = acts * reached
    sign = np.sign(moved @ np.einsum('kkn,kkn->k', rows, rows)) or -1.0
    parts = np.sqrt(np.maximum(sign * moved, LEAST_PART ** 2)) * np.where(reached < 0, -1.0, 1.0)
    masses = np.log(np.maximum(np.abs(reached), 1e-9) / np.maximum(np.abs(acts), 1e-9))
    masses -= 3 * np.log(modes.frequencies_hz)
    return local_change(nominal, sign, parts, masses - masses[np.argmax(np.abs(parts))])


def from_frequencies(nominal, moved, ties, likelihood):
    """
    Return the form begun at relative changes of modal stiffness (m,) of the modes of a record.

    `ties` are (i, j, stiffness between two modes). Other signs are those of the largest
    `likelihood` of a form, as far as changing one after the other leads.
    """
    sign = np.sign(np.sum(moved)) or 1.0
    parts = np.sqrt(np.maximum(sign * moved, LEAST_PART ** 2))
    for i, j, tie in ties:
        parts[j] *= np.sign(parts[i] * tie * sign) or 1.0
    best = local_change(nominal, sign, parts)
    most = likelihood(best)
    for i in np.argsort(-np.abs(parts)):
        parts[i] *= -1
        form = local_change(nominal, sign, parts)
        if (there := likelihood(form)) > most:
            best, most = form, there
        else:
            parts[i] *= -1
    return best


@lru_cache(maxsize=2)
def _near(modes, cut):
    """Return bands near each mode, (c,), their windows (c, 1), and a LocalChange in them."""
    found = []
    for k, (f0, xi) in enumerate(zip(modes.frequencies_hz, modes.damping_ratios)):
        bands, f, window = around(cut, f0, reach_hz(f0, xi, cut), POINTS)
        found.append((bands, window[:, None], LocalChange(
            f, modes.frequencies_hz, modes.damping_ratios, k)))
    return found
