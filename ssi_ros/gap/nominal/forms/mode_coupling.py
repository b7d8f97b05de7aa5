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
from ssi_ros.gap.nominal.modal.reference import around, found_again, reach_hz
from ssi_ros.hermitian import matrix_power
from ssi_ros.structural_modification import TwoModes

APART = 0.1             # logarithm of the ratio of two frequencies that may mix
ALIKE = 5.0             # condition of their shapes, beyond which channels do not distinguish them
MOST_MIXED = 0.5        # stiffness between two modes over their own
WIDE = 4.0              # reaches of a mode, as far as a pair dominates


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
    moved, ties = moved_stiffness(modes, there)
    if not ties or not moved.any():
        return None

    pairs = [(i, j) for i, j, _ in ties]
    mixing = [_mixer(nominal, pair) for pair in pairs]
    paired = [k for pair in pairs for k in pair]

    def change(n, x):
        x = np.array(x)
        own = np.exp(x[:count] / 2)
        own[paired] = 1.0
        gain = modal_gain(n, own, np.ones(count))
        for mix, (i, j), (tie, force, loss) in zip(mixing, pairs, x[count:].reshape(-1, 3)):
            near, mixed = mix(x[i], x[j], tie, force, loss)
            gain[near] = mixed @ gain[near]
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
                showing(ModalPattern.COMMON_FREQUENCY_RATIO)[0], begin=np.append(
                    moved, [(tie, 0.0, 0.0) for *_, tie in ties]))


def moved_stiffness(modes, there):
    """
    Return the stiffness of all modes beside that of another recording's, and what ties close ones.

    Logarithms (m,) relative to the own ones, and of each close pair (i, j, stiffness between).
    """
    moved, pairs, shapes = np.zeros(len(modes)), close_pairs(modes), real_shapes(modes)
    if not len(there):
        return moved, []
    found_shapes = real_shapes(there)
    alike = (shapes.T @ found_shapes) ** 2
    for pair in pairs:              # a mixture of two is as good as either
        basis = np.linalg.qr(shapes[:, list(pair)])[0]
        alike[list(pair)] = np.sum((basis.T @ found_shapes) ** 2, axis=0)
    again = found_again(modes, there, alike)
    ties = np.zeros(len(pairs))
    for i, (_, ratio) in again.items():
        moved[i] = 2 * ratio
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
        moved[pair] = np.log(np.diag(stiffness))
        ties[k] = np.clip(stiffness[0, 1], -MOST_MIXED, MOST_MIXED)
    return moved, [(*pair, tie) for pair, tie in zip(pairs, ties)]


def _mixer(nominal, pair):
    """
    Return a function of five numbers: bands and filter of two modes that mixed, (c, l, l).

    The numbers are the logarithms of the stiffness of both, the stiffness between them, and the
    logarithms of force and damping of what moved more.
    """
    modes, cut, pair = nominal.modes, nominal.cut, list(pair)
    f0, xi = modes.frequencies_hz[pair], modes.damping_ratios[pair]
    reach = WIDE * max(reach_hz(f, x, cut) for f, x in zip(f0, xi)) + np.ptp(f0)
    near, f, window = around(cut, f0.mean(), reach, POINTS)
    shapes = real_shapes(modes)[:, pair]
    duals = np.linalg.pinv(shapes)
    both = TwoModes(f, f0, xi, duals @ nominal.spectrum[near] @ duals.T)

    @lru_cache(maxsize=64)
    def mix(one, two, tie, force, loss):
        ratio = both.ratio(np.array([[np.exp(one), tie], [tie, np.exp(two)]]), force, loss)
        turned = shapes @ (matrix_power(ratio, window) - np.eye(2)) @ duals
        return near, np.eye(len(shapes)) + turned
    return mix
