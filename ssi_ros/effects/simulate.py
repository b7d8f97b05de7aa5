"""Simulate a setup: the linear simulator, nonlinear hinges, drifting stiffness, sampling times."""
from dataclasses import replace
from itertools import takewhile

import numpy as np

from ssi_ros.effects.base import lateness
from ssi_ros.effects.edits import scale_stiffness, with_held_inputs
from ssi_ros.model.excitation import begin_all, generator
from ssi_ros.model.joints import JointLaw, simulate_joints
from ssi_ros.model.nonlinear import simulate_nonlinear
from ssi_ros.model.sensors import Mix
from ssi_ros.model.simulator import check_rate, propagate, simulate, stationary_start
from ssi_ros.records import Samples

HINGE_STEP_HZ = 2000.0      # least internal rate of nonlinear hinges
# a drifting stiffness takes its next value where it has changed by so much of itself,
DRIFT_STEP = 1e-4
DRIFT_STEP_S, DRIFT_STEPS = 0.5, 100        # after so long at least, and so often in a record
MARGIN = 400                # rows on each side that band-limited interpolation needs
FINER = 8                   # times finer grid from which a cubic spline interpolates


def simulate_setup(setup, seed, *, at_rest=False, start_ns=0, progress=None):
    """
    Simulate the record of a setup, over its duration.

    Parameters
    ----------
    setup : Setup
        Of `inject`.
    seed : int
        The same seed gives the same numbers.
    at_rest, start_ns, progress
        As in `ssi_ros.model.simulate`.

    Returns
    -------
    Samples
        On the stamps' grid, whatever the true clock did; NaN where a sample was dropped.

    Raises
    ------
    ValueError
        If a combination of effects cannot be simulated; the message says which.

    """
    system, rate_hz = setup.system, setup.system.rate_hz
    count = round(setup.duration_s * setup.stamp_rate_hz)
    moves = bool(setup.delays_s or setup.corners_hz or setup.late) or setup.jitter_rms_s > 0.0
    rows = count + 2 * MARGIN if moves else count
    bare = replace(system, chain=())
    if setup.laws or setup.drift:
        bare = replace(bare, excitation=with_held_inputs(setup).system.excitation)
    if setup.laws and setup.drift:
        raise ValueError('a nonlinear joint and a drifting stiffness cannot be simulated '
                         'together; give one of them')
    if setup.laws and isinstance(setup.laws[0], JointLaw):
        values = simulate_joints(bare, rows / rate_hz, seed, setup.laws, at_rest=at_rest).values
    elif setup.laws:
        samples, _ = simulate_nonlinear(
            bare, rows / rate_hz, seed, laws=setup.laws, at_rest=at_rest,
            substeps=max(1, int(np.ceil(HINGE_STEP_HZ / rate_hz))))
        values = samples.values
    elif setup.drift:
        values = _drifting(bare, setup, rows, seed, at_rest)
    else:
        values = simulate(bare, rows / rate_hz, seed, at_rest=at_rest, rate_hz=rate_hz,
                          progress=progress).values
    chain = list(system.chain)
    # channels that are read at their own instants have been mixed before
    mixes = list(takewhile(lambda stage: isinstance(stage, Mix), chain)) if setup.late else []
    if moves:
        values = _resampled(values, setup, seed, count, mixes)
    for stage in chain[len(mixes):]:
        values = stage.begin(rate_hz, generator(seed, stage.name))(values)
    return Samples(values, setup.stamp_rate_hz, system.channels, start_ns)


def _drifting(system, setup, count, seed, at_rest):
    """Propagate with D stepped evenly; positions and speeds carry over, eq. (86)."""
    if system.shaping is not None or system.conditioning is not None:
        raise ValueError('stiffness_drift cannot be simulated together with a coloured excitation '
                         'or a low-pass of the sensors; give one of them')
    rate_hz = system.rate_hz
    check_rate(system, rate_hz)
    arrays = [a.name for a in setup.spacecraft.arrays]
    forces = begin_all(system.excitation, rate_hz, system.inputs, seed)
    part = max(DRIFT_STEP / abs(setup.drift), DRIFT_STEP_S * rate_hz / count)
    step = max(1, round(min(part, 1 / DRIFT_STEPS) * count))
    values, x = [], None
    for first in range(0, count, step):
        rows = min(step, count - first)
        share = (first + rows / 2) / count
        sampled = scale_stiffness(system, arrays,
                                  1.0 + setup.drift * share).plant.discrete(rate_hz)
        if x is not None:
            z = sampled.inverse @ x
        elif at_rest:
            z = np.zeros(len(sampled.poles), complex)
        else:
            z = stationary_start(sampled, system.excitation, system.inputs, seed)
        block, z = propagate(sampled, forces(first, rows), z)
        x = ((sampled.vectors * sampled.weight) @ z).real
        values.append(block)
    return np.concatenate(values)


def _resampled(values, setup, seed, count, mixes):
    """Read every channel at its own instants by band-limited interpolation, eq. (89)."""
    rate_hz, rows = setup.system.rate_hz, len(values)
    # The ends fade in and out, so that the periodic interpolation does not ring; they are cut off.
    edge = np.minimum(np.arange(rows), np.arange(rows)[::-1]) / (MARGIN / 4)
    spectrum = np.fft.rfft(values * np.minimum(1.0, edge)[:, None], axis=0)
    cycles = np.fft.rfftfreq(rows)
    spectrum = spectrum * setup.reading(cycles * rate_hz)
    for stage in mixes:
        spectrum = spectrum @ stage.response(np.zeros(1), spectrum.shape[1])[0].T
    if setup.late:
        spectrum = spectrum * lateness(setup.late, cycles)
    values = np.fft.irfft(spectrum, rows, axis=0)
    if not setup.jitter_rms_s:
        return values[MARGIN:MARGIN + count]
    from scipy.interpolate import CubicSpline
    from scipy.signal import resample
    fine = resample(values, FINER * rows)
    when = (MARGIN + np.arange(count)) / rate_hz
    when = when + setup.jitter_rms_s * generator(seed, 'jitter').standard_normal(count)
    at = np.arange(len(fine)) / (FINER * rate_hz)
    return np.column_stack([CubicSpline(at, column)(when) for column in fine.T])
