"""
How far the height of a resonance may be off at one line of the whole record, eq. (193).

A resonance of 0.36 Hz and half a per cent of damping is two lines of a record of ten minutes wide,
and the record tells its damping to a third. Where its damping is half of what the model has, its
peak is four times as high, and no segment is long enough to show that it is no sine. So a line at
a resonance counts by its chance among all dampings and frequencies that the record leaves open.
"""
import numpy as np
from scipy.special import lambertw

from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.model.disturbances import Sine
from ssi_ros.model.errors import DAMPING, declared
from ssi_ros.model.excitation import source

LEAST = 1e-6            # doubt below which a power counts as it is
NEAR, BESIDE_SINE = 2.5, 1.0        # lines from a sine of the model, and the doubt there


def resonance_doubt(simulator, setup, frame):
    """
    Return the standard deviation of the logarithm of the expected power at every line.

    Parameters
    ----------
    simulator : Simulator
        The model, with the uncertainty that is declared of it.
    setup : Setup
        Its system at a fit.
    frame : Frame
        One segment, of the whole record.

    Returns
    -------
    ndarray, (k,)
        0 for a model whose damping is declared exact.

    """
    names, stds = declared(simulator.spacecraft)
    known = [s for n, s in zip(names, stds) if n.startswith(f'{DAMPING} ')]
    doubt = np.zeros(frame.last - frame.first)
    if not known:
        return doubt
    lines = np.arange(frame.first, frame.last)
    system = linearise(setup).system
    for pole in system.state_space.discrete(system.rate_hz).poles:
        # half-power half-width and frequency in lines: of a record of T s these are zeta f T, f T
        width = -np.log(max(np.abs(pole), 1e-300)) * frame.rows / (2 * np.pi)
        centre = np.angle(pole) * frame.rows / (2 * np.pi)
        if centre > 0.0:
            std = (max(known) ** -2 + 2 * np.pi * width) ** -0.5
            doubt = np.maximum(doubt, 2 * std / np.hypot(1.0, (lines - centre) / width))
    for sine in filter(lambda part: isinstance(part, Sine), map(source, system.excitation)):
        # what errors of shapes leave of a strong sine in the other channels is no sine of its own
        away = np.abs(lines - sine.frequency_hz * frame.rows / system.rate_hz)
        doubt = np.where(away < NEAR, np.maximum(doubt, BESIDE_SINE), doubt)
    return doubt


def discounted(power, doubt):
    """Return powers that are as rare in an exact model as these beside a doubt, eq. (193)."""
    square = np.square(np.maximum(doubt, LEAST))
    w = lambertw(square * power).real
    return np.where(doubt < LEAST, power, (w + w ** 2 / 2) / square)
