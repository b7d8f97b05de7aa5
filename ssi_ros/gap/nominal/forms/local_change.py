"""
A local change of the structure: one spring, mass or damper, of rank one in the modes, (147b).

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
from ssi_ros.gap.nominal.modal.reference import around
from ssi_ros.identify.shapes import mac
from ssi_ros.structural_modification import LocalChange, rank_one

POINTS = 9              # at which a resonance is averaged over a band
MOST_MASS = 6.0         # logarithm of one modal mass over another
LEAST_PART = 1e-3       # root of a relative change of stiffness at which a fit begins
MOST_ROWS = 5_000_000   # numbers of all scores that a start is sought by; bands are left out
BY_CHANCE = 0.05        # of a MAC of parts and shapes: the place does not move as a channel does


def local_change(nominal, sign, parts, masses=0.0, damper=False):
    """
    Return the form of one local change that lowers (sign -1) or raises (1) frequencies.

    A `damper` lowers or raises damping in their place; either is some of the other, by the angle
    that is the last number. It begins at `parts` (m,), roots of the relative changes of modal
    stiffness with the signs of the modes at the place, and `masses` (m,), logarithms of modal
    masses over that of the mode that changes most, times the cube of the ratio of frequencies:
    between a spring and a mass.
    """
    modes, cut, count = nominal.modes, nominal.cut, len(nominal.modes)
    first, near = int(np.argmax(np.abs(parts))), _near(modes, cut)
    others = np.flatnonzero(np.arange(count) != first)
    upright, hz = np.pi / 2 * damper, modes.frequencies_hz[first]
    usual = 3 * np.log(modes.frequencies_hz / modes.frequencies_hz[first])

    def change(_, x):
        part, mass = np.array(x[:count]), usual.copy()
        mass[others] += x[count:-1]
        acts, reached = sign * part * np.exp(-mass / 2), part * np.exp(mass / 2)
        gain = np.tile(np.eye(len(nominal.channels), dtype=complex), (cut.bands, 1, 1))
        for k, (bands, window, both) in enumerate(near):
            ratio = both.ratio(acts, reached, upright + x[-1], hz)
            own = np.exp(window[:, 0] * ratio[:, k]) - 1
            ratio *= window
            ratio[:, k] = own
            gain[bands] += (ratio @ modes.shapes.T)[..., None] * modes.duals[:, k].conj()
        return gain, None
    at = [at_mode(f) for f in modes.frequencies_hz]
    # of stiffness, or of damping
    grows = modes.frequencies_hz / hz / (2 * modes.damping_ratios) if damper else np.ones(count)
    numbers = [Number(f'scale_{n}', '1', 0.01, -1.0, 1.0, lambda x, by=g: 1 + sign * by * x ** 2)
               for n, g in zip(at, grows)]
    numbers += [Number(f'modal_mass_{at[i]}', '1', 0.1, -MOST_MASS, MOST_MASS, np.exp)
                for i in others]
    numbers.append(Number('loss_angle', 'rad', 0.1, -np.pi / 4, np.pi / 4, lambda x: upright + x))
    masses = np.clip(masses + np.zeros(count), -MOST_MASS / 3, MOST_MASS / 3)
    what, pattern, common = (
        ('damper', ModalPattern.MODE_DAMPINGS, ModalPattern.COMMON_DAMPING_RATIO) if damper else
        ('spring or mass', ModalPattern.MODE_FREQUENCIES, ModalPattern.COMMON_FREQUENCY_RATIO))
    return Form({'modes': 'local'}, tuple(numbers), change,
                f'one {what} changed: modes moved and their shapes turned',
                pattern, showing(common)[0], begin=np.concatenate([parts, masses[others], [0.0]]),
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


def from_scores(nominal, spectrum, residual, white, damper=False):
    """
    Return the form begun where a whitened residual (n,) around a spectrum (b, l, l) leads.

    `white` whitens a change of the spectrum (b, l, l), (n,).
    """
    modes, cut, count, total = nominal.modes, nominal.cut, len(nominal.modes), nominal.cut.bands
    hz = np.median(modes.frequencies_hz)
    step = 1 + count ** 2 * len(residual) // MOST_ROWS
    residual = residual.reshape(total, -1)[::step].ravel()
    rows = np.zeros((count, count, len(residual)))
    for k, (bands, window, both) in enumerate(_near(modes, cut)):
        turned = both.weight * both.turned(np.pi / 2 * damper, hz)
        response = (turned[:, None] @ both.response)[:, 0]
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
    first = np.argmax(np.abs(parts))
    parts *= np.sqrt(modes.frequencies_hz[first] / hz) if damper else 1.0
    return local_change(nominal, sign, parts, masses - masses[first], damper)


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
    for k, f0 in enumerate(modes.frequencies_hz):
        bands, f, window = around(cut, f0, modes.reach_hz(k, cut), POINTS)
        found.append((bands, window[:, None], LocalChange(
            f, modes.frequencies_hz, modes.damping_ratios, k)))
    return found
