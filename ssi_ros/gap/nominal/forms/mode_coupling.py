"""
Modes that mix: two close modes of the reference, tied by a stiffness between them, eq. (147a).

Two arrays alike have their modes in close pairs, in phase and against each other. Where the hinge
of one of them gives, the pair falls apart into one mode of each array. No change of frequencies
alone has that form: the shapes turn.
"""
from functools import lru_cache

import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import showing
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.forms.sensor import at_mode
from ssi_ros.gap.nominal.forms.structure import modal_gain, POINTS
from ssi_ros.gap.nominal.modal.reference import found_again, reach_hz
from ssi_ros.hermitian import matrix_power

APART = 0.1             # logarithm of the ratio of two frequencies that may mix
ALIKE = 5.0             # condition of their shapes, beyond which channels do not distinguish them
MOST_MIXED = 0.5        # stiffness between two modes over their own
WIDE = 4.0              # reaches of a mode, as far as a pair dominates
LEAST_POWER = 1e-3      # of the stronger force on two modes


def close_pairs(modes):
    """Return the pairs of modes that may mix, closest first, each mode once."""
    logs = np.log(modes.frequencies_hz)
    found = sorted((logs[j] - logs[i], i, j) for i in range(len(logs))
                   for j in range(i + 1, len(logs)) if logs[j] - logs[i] < APART)
    pairs = []
    for _, i, j in found:
        if not {i, j} & {k for p in pairs for k in p} and (
                np.linalg.cond(real_shapes(modes)[:, [i, j]]) < ALIKE):
            pairs.append((i, j))
    return pairs


def real_shapes(modes):
    """Return the real shapes of unit length, (l, m): their largest component is real."""
    shapes = modes.shapes.real
    return shapes / np.linalg.norm(shapes, axis=0)


def mixed_modes(nominal, there):
    """Return the form of modes that moved and mixed, begun at the Modes of a record, or None."""
    modes, count = nominal.modes, len(nominal.modes)
    pairs = close_pairs(modes)
    if not pairs or not len(there):
        return None
    begin = _begin(modes, pairs, there)
    if not begin.any():
        return None

    mixing = [_mixer(nominal, pair) for pair in pairs]
    paired = [k for pair in pairs for k in pair]

    def change(n, x):
        x = np.array(x)
        own = np.exp(x[:count] / 2)
        own[paired] = 1.0
        gain = modal_gain(n, own, np.ones(count))
        for mix, (i, j), (tie, force, loss) in zip(mixing, pairs, x[count:].reshape(-1, 3)):
            gain = mix(x[i], x[j], tie, force, loss) @ gain
        return gain, None
    numbers = [Number(f'scale_{at_mode(f)}', '1', 0.002, -1.0, 1.0, np.exp)
               for f in modes.frequencies_hz]
    for i, _ in pairs:
        at = at_mode(modes.frequencies_hz[i])
        numbers += [Number(f'tie_{at}', '1', 0.002, -MOST_MIXED, MOST_MIXED),
                    Number(f'force_{at}', '1', 0.1, -5.0, 5.0, np.exp),
                    Number(f'damping_{at}', '1', 0.1, -3.0, 3.0, np.exp)]
    return Form({'modes': 'mixed'}, tuple(numbers), change,
                'modes moved, not all alike, and close ones mixed', ModalPattern.MODE_FREQUENCIES,
                showing(ModalPattern.COMMON_FREQUENCY_RATIO)[0], begin=begin)


def _begin(modes, pairs, there):
    """Return logarithms of stiffness of every mode and ties of every pair, (m + 3 pairs,)."""
    count, shapes = len(modes), real_shapes(modes)
    found_shapes = real_shapes(there)
    alike = (shapes.T @ found_shapes) ** 2
    for pair in pairs:              # a mixture of two is as good as either
        basis = np.linalg.qr(shapes[:, list(pair)])[0]
        alike[list(pair)] = np.sum((basis.T @ found_shapes) ** 2, axis=0)
    again = found_again(modes, there, alike)
    found = np.zeros(count + 3 * len(pairs))
    for i, (_, ratio) in again.items():
        found[i] = 2 * ratio
    for k, pair in enumerate(pairs):
        pair = list(pair)
        if not all(i in again for i in pair):
            continue
        which = [again[i][0] for i in pair]
        turn = np.linalg.lstsq(shapes[:, pair], found_shapes[:, which], rcond=None)[0]
        left, _, right = np.linalg.svd(turn)
        turn = left @ right
        stiffness = turn @ np.diag(there.frequencies_hz[which] ** 2) @ turn.T
        stiffness /= np.outer(*(modes.frequencies_hz[pair],) * 2)
        found[pair] = np.log(np.diag(stiffness))
        found[count + 3 * k] = np.clip(stiffness[0, 1], -MOST_MIXED, MOST_MIXED)
    return found


def _mixer(nominal, pair):
    """
    Return a function of five numbers: the filter of two modes that moved and mixed, (b, l, l).

    The numbers are the logarithms of the stiffness of both, the stiffness between them, and the
    logarithms of force and damping of what moved more. Of all filters that turn the power V of
    both in a band into the power W after it, this is the nearest to none, (147a).
    """
    modes, cut, pair = nominal.modes, nominal.cut, list(pair)
    f0, xi = modes.frequencies_hz[pair], modes.damping_ratios[pair]
    reach = WIDE * max(reach_hz(f, x, cut) for f, x in zip(f0, xi)) + np.ptp(f0)
    away = (cut.middles_hz - f0.mean()) / reach
    near = np.flatnonzero(np.abs(away) < 3.0)
    window = 1 / (1 + away[near] ** 8)
    half = (cut.band_bins / 2 + 1) * cut.resolution_hz
    f = cut.middles_hz[near][:, None, None] + np.linspace(-half, half, POINTS)[:, None]
    shapes = real_shapes(modes)[:, pair]
    duals = np.linalg.pinv(shapes)
    before = 1 / (f0 ** 2 - f ** 2 + 2j * f * xi * f0)              # (near, points, 2)
    passed = np.mean(before[..., :, None] * before[..., None, :].conj(), axis=1)
    acting = _force(duals @ nominal.spectrum[near] @ duals.T, passed)
    root = matrix_power(passed * acting, 0.5)
    back = np.linalg.inv(root)
    still = np.tile(np.eye(len(shapes), dtype=complex), (cut.bands, 1, 1))

    @lru_cache(maxsize=64)
    def mix(one, two, tie, force, loss):
        stiffness = np.array([[np.exp(one), tie], [tie, np.exp(two)]])
        sizes, turn = np.linalg.eigh(stiffness)
        moved = turn[:, np.argmax(np.abs(np.log(np.maximum(sizes, 1e-12))))]
        moved = np.outer(moved, moved)
        lost = (np.eye(2) + np.expm1(loss) * moved) * np.sqrt(np.outer(xi * f0, xi * f0))
        push = np.eye(2) + np.expm1(force / 2) * moved
        after = np.linalg.inv(stiffness * np.outer(f0, f0) + 2j * f[..., None] * lost
                              - f[..., None] ** 2 * np.eye(2)) @ push
        there = np.mean(after @ acting @ after.conj().swapaxes(-1, -2), axis=1)
        ratio = matrix_power(back @ matrix_power(root @ there @ root, 0.5) @ back, window)
        gain = still.copy()
        gain[near] += shapes @ (ratio - np.eye(2)) @ duals
        return gain
    return mix


def _force(response, passed):
    """Return the spectrum of the forces on two modes, (2, 2), that their motion shows best."""
    force = np.sum(response * passed.conj(), axis=0) / np.sum(np.abs(passed) ** 2, axis=0)
    values, vectors = np.linalg.eigh((force + force.conj().T) / 2)
    return (vectors * np.maximum(values, LEAST_POWER * values.max())) @ vectors.conj().T
