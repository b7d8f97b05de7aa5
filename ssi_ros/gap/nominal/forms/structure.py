"""Modal forms of the structure: filters that move modes, eq. (147); each is null at x = 0."""
from functools import lru_cache

import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import modal_form
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.forms.sensor import at_mode
from ssi_ros.gap.nominal.modal.reference import around
from ssi_ros.structural_modification import moved_mode

POINTS = 17             # at which a resonance is averaged over a band
WIDER = 1.5             # times its shift, the distance from a mode at which the shift still counts
DRIFT_STEPS = 9         # of the mean over a drift


def modal_gain(nominal, ratios, damping_ratios):
    """Return the filter (b, l, l) that multiplies frequencies, damping by ratios (m,), (147)."""
    modes, cut = nominal.modes, nominal.cut
    gain = np.tile(np.eye(len(nominal.channels), dtype=complex), (cut.bands, 1, 1))
    for i in np.flatnonzero((ratios != 1.0) | (damping_ratios != 1.0)):
        near, factor = _moved(modes, cut, i, ratios[i], damping_ratios[i])
        picked = modes.duals[:, i].conj() @ gain[near]
        gain[near] += (factor[:, None] * modes.shapes[:, i])[..., None] * picked[:, None]
    return gain


@lru_cache(maxsize=256)
def _moved(modes, cut, i, ratio, damping_ratio):
    """Return bands near a mode, and what it has more of itself in each, both (c,)."""
    f0, xi = modes.frequencies_hz[i], modes.damping_ratios[i]
    reach = max(modes.reach_hz(i, cut), WIDER * abs(ratio - 1) * f0)
    near, f, window = around(cut, f0, reach, POINTS)
    own = moved_mode(f, (f0, xi), (f0 * ratio, xi * damping_ratio))
    return near, np.exp(window * own) - 1


@modal_form('stiffness_scale')
def frequencies(nominal):
    """Yield all modes moved by one factor, and each on its own."""
    return _of_modes(
        nominal, lambda n, x: modal_gain(n, np.exp(x / 2), np.ones(len(x))), (0.002, 1.0),
        ('all frequencies changed by one factor', ModalPattern.COMMON_FREQUENCY_RATIO),
        ('some modes changed, not all alike', ModalPattern.MODE_FREQUENCIES))


@modal_form('damping_scale')
def dampings(nominal):
    """Yield the damping of all modes changed by one factor, and of each on its own."""
    return _of_modes(
        nominal, lambda n, x: modal_gain(n, np.ones(len(x)), np.exp(x)), (0.1, 4.0),
        ('', ModalPattern.COMMON_DAMPING_RATIO),
        ('some modes are damped otherwise', ModalPattern.MODE_DAMPINGS))


def _of_modes(nominal, gain, sizes, common, each):
    """Yield two forms of logarithms x (m,) of every mode: one in common, and each its own."""
    (start, most), modes = sizes, nominal.modes
    number = ('1', start, -most, most, np.exp)
    if len(modes):
        yield Form({}, (Number('scale', *number),),
                   lambda n, x: (gain(n, np.full(len(n.modes), x[0])), None), *common)
    if len(modes) > 1:
        yield Form({'modes': 'each'}, tuple(
            Number(f'scale_{at_mode(f)}', *number) for f in modes.frequencies_hz),
            lambda n, x: (gain(n, np.array(x)), None), *each, each_mode=True)


def drifting_frequencies(nominal, odds):
    """Return the form of frequencies that move through the record, eq. (163), with its odds."""
    steps = (np.arange(DRIFT_STEPS) + 0.5) / DRIFT_STEPS

    def change(n, x):
        ones = np.ones(len(n.modes))
        return np.array([modal_gain(n, np.sqrt(1 + x[0] * u) * ones, ones) for u in steps]), None
    return Form({}, (Number('change', '1', 0.01, -0.5, 0.5),), change,
                'frequencies move through the record', ModalPattern.FREQUENCY_DRIFT, bonus=odds)


def amplitude_dependent(nominal, pattern, added, meaning, odds):
    """Return the equivalent linear form of an amplitude-dependent joint, with odds, (157)."""
    # every mode takes the frequency and the damping of the other amplitude; the distortion, (b, l,
    # l) or None, is beside them
    count = len(nominal.modes)

    def change(n, x):
        return modal_gain(n, np.exp(x[:count] / 2), np.exp(x[count:2 * count])), added
    names = [at_mode(f) for f in nominal.modes.frequencies_hz]
    numbers = tuple(Number(f'stiffness_{n}', '1', 0.002, -1.0, 1.0, np.exp) for n in names)
    numbers += tuple(Number(f'damping_{n}', '1', 0.1, -3.0, 3.0, np.exp) for n in names)
    return Form({}, numbers, change, meaning, pattern, each_mode=count > 1, bonus=odds)
