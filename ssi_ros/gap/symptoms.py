"""
Signs that no spectrum shows: steps, rails, losses, jolts, swings of level; eq. (107) to (110).

Each test says how sure it is and at which size the effect explains the sign.
"""
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ssi_ros.effects import effect_class, inject

LEVEL_S = 5.0           # windows in which the level of the record is followed
RAIL_HITS = 3           # times that a channel must show exactly its extreme


@dataclass(frozen=True)
class Symptom:
    """A sign of one effect: its p-value where the effect is absent, and the size it speaks for."""

    effect: object
    p_value: float
    text: str


def symptoms(samples):
    """
    Look for signs in the samples alone.

    Parameters
    ----------
    samples : Samples
        The record.

    Returns
    -------
    tuple of Symptom
        Those that are there.

    """
    found = [test(samples) for test in (_losses, _rails, _steps)]
    return tuple(s for s in found if s is not None)


def _losses(samples):
    fraction = float(np.isnan(samples.values).any(axis=1).mean())
    if fraction == 0.0:
        return None
    return Symptom(effect_class('dropped_samples')(fraction=fraction), 0.0,
                   f'{100 * fraction:.2g} % of the rows are missing')


def _steps(samples):
    """Find a step of which all values are multiples: they are few and evenly spaced."""
    steps = []
    for column in samples.values.T:
        column = column[np.isfinite(column)]
        values = np.unique(column)
        inner = values[1:-1]                       # the rails need not be multiples
        if len(inner) < 3 or len(values) > 0.5 * len(column):
            return None
        gaps = np.diff(inner)
        step = gaps[gaps > 1e-6 * gaps.max()].min()
        step = np.median(gaps[gaps < 1.5 * step])
        step = (inner[-1] - inner[0]) / np.rint((inner[-1] - inner[0]) / step)
        if np.abs(inner / step - np.rint(inner / step)).max() > 0.01:
            return None
        steps.append(step)
    step = float(np.median(steps))
    return Symptom(effect_class('quantisation')(step_m_s2=step), 0.0,
                   f'all values are multiples of {step:.4g} m/s^2')


def _rails(samples):
    limits = []
    for column in samples.values.T:
        column = column[np.isfinite(column)]
        top = np.abs(column).max()
        hits = np.count_nonzero(np.abs(column) == top)
        distinct = len(np.unique(column))
        # of rounded values the extreme may come twice; at a rail it comes more than its neighbour
        below = np.abs(column)[np.abs(column) < top]
        next_hits = np.count_nonzero(np.abs(column) == below.max()) if len(below) else 0
        if hits >= RAIL_HITS and (distinct > 0.5 * len(column) or hits > 5 * next_hits + 5):
            limits.append(top)
    if not limits:
        return None
    limit = float(min(limits))
    hit = np.nanmean(np.abs(samples.values) >= limit)
    return Symptom(effect_class('saturation')(limit_m_s2=limit), 0.0,
                   f'{100 * hit:.2g} % of the values are at the rails of {limit:.4g} m/s^2')


def jolts(simulator, fitted, evidence, threshold=4.5):
    """
    Look for pulses in the torque that explains the record best, eq. (109).

    The torque is estimated by the Wiener filter of the fitted model; pulses stand out of its
    Gaussian samples.

    Returns
    -------
    Symptom or None
        None where the largest sample is as large as chance makes it.

    """
    frame = evidence.frame
    system = inject(simulator.spacecraft, (), simulator.duration_s).system
    where = system.inputs.index('torque_x')
    response = system.transfer(frame.frequencies_hz, system.rate_hz)[:, :, where]
    rms = [p for p in system.excitation if p.name == 'torque'][0].held_rms(system.rate_hz)[0]
    power = rms ** 2 * fitted.levels[0]
    gain = power * np.einsum('ki,kij->kj', response.conj(), np.linalg.inv(fitted.model[0]))
    own = np.einsum('kj,kj->k', gain, response).real         # share of a pulse that comes through
    spectrum = np.zeros((len(evidence.pieces), frame.rows // 2 + 1), complex)
    spectrum[:, frame.first:frame.last] = np.einsum(
        'kj,skj->sk', gain, evidence.spectrum[list(evidence.pieces)])
    middle = np.flatnonzero(frame.taper > 0.999 * frame.taper.max())
    torque = np.fft.irfft(spectrum, frame.rows, axis=1)[:, middle] / frame.taper.max()
    through = 2 * own.sum() / frame.rows
    sigma = 1.4826 * np.median(np.abs(torque))
    z = torque / sigma
    count = z.size
    excess = float(np.mean(z ** 4) / np.mean(z ** 2) ** 2 - 3)
    z_excess = excess / np.sqrt(24 / count * 3)              # 3: neighbours repeat each other
    largest = float(np.abs(z).max())
    p = min(1.0, 2 * min(2 * count * norm.sf(largest), norm.sf(z_excess)))
    if p > 0.01:
        return None
    # a local extreme beyond the threshold is a pulse; its height tells the impulse
    beyond = (np.abs(z) > threshold) & (np.abs(z) >= np.abs(np.roll(z, 1, axis=1))) & (
        np.abs(z) >= np.abs(np.roll(z, -1, axis=1)))
    heights = torque[beyond]
    if not len(heights):
        return None
    impulse = float(np.median(heights)) / through / system.rate_hz
    rate = len(heights) / (count / system.rate_hz) * 60
    return Symptom(effect_class('impulsive_events')(
        rate_per_min=max(rate, 0.01), impulse_n_m_s=impulse), p,
        f'the torque has {len(heights)} samples beyond {threshold:g} sd, excess {excess:.2g}')
