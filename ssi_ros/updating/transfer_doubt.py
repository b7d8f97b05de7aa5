"""
By how much errors of a model put off what a test finds in an input, eq. (110e).

The amplitude of a line, and the height of impulses, are those of the record over the transfer
function h from the input to the channels. Where that is d h off, S being the expected spectrum, an
amplitude is Re(h^H S^-1 d h) / h^H S^-1 h off, the mean over the lines that it is of; the phase
of a sweep is the imaginary part off, which moves its ends.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.candidate import Candidate

STEP = 0.1              # deviations of an error, for a difference quotient
LEAST = 0.5             # of an amplitude over the one it is found with, at which a correction ends


def beside_errors(detection, here, null, side, fitted):
    """
    Return a Detection beside the most probable errors of the model, and what they leave open.

    Errors that are fitted without a line have taken up a part of it; beside it they are others.

    Parameters
    ----------
    detection : Detection
        Of an effect, found beside a model without it.
    here, side : Side
        That model, and the one that the effect was fitted beside.
    null, fitted : Fit
        Of the model without the effect and with it.

    Returns
    -------
    Detection

    """
    effect = detection.basis
    driven = effect.driven_hz()
    if driven is None:
        return detection
    frequencies = here.simulator.frame.frequencies_hz
    lines = np.flatnonzero((frequencies >= min(driven)) & (frequencies <= max(driven)))
    if not len(lines):
        lines = np.array([np.argmin(np.abs(frequencies - driven[0]))])
    off, weights = _off_by(here, null, lines)
    shift, std = _of_errors(weights @ off.real, here, side, fitted)
    share = 1 / max(1 + shift, LEAST)
    size = getattr(effect, effect.size) * share
    stds = {effect.size: np.hypot(detection.stds[effect.size] * share, size * std)}
    if driven[0] != driven[-1] and np.isfinite(driven).all() and len(lines) > 3:
        part = (frequencies[lines] - driven[0]) / (driven[1] - driven[0])
        turns = 2 * np.pi * here.simulator.duration_s * np.array(
            [part - part ** 2 / 2, part ** 2 / 2])      # phase by the first and last frequency
        columns = np.vstack([np.ones(len(lines)), turns]).T * np.sqrt(weights)[:, None]
        ends = np.linalg.pinv(columns) @ (np.sqrt(weights)[:, None] * off.imag)
        for name, end in zip(('start_hz', 'end_hz'), ends[1:]):
            stds[name] = np.hypot(detection.stds[name], np.hypot(
                *_of_errors(end, here, side, fitted)))
    basis = replace(effect, **{effect.size: float(size)})
    return replace(detection, basis=basis, parameters=detection.parameters | basis.values(),
                   stds=detection.stds | {name: float(v) for name, v in stds.items()})


def _off_by(here, null, lines):
    """Return what errors put off at lines, (k, m) complex, each by 1, and weights (k,)."""
    simulator, values = here.simulator, _values(here)
    steps = STEP * np.maximum(np.linalg.norm(here.prior.root, axis=1), 1e-12)
    spectrum = null.plain.mean(axis=0)[lines]

    def transfer(at):
        system = simulator.at_errors(at).setup(Candidate()).system
        return system.transfer(simulator.frame.frequencies_hz[lines], system.rate_hz,
                               slice(1))[:, :, 0]
    usual = transfer(values)
    toward = np.linalg.solve(spectrum, usual[:, :, None])[:, :, 0].conj()
    power = np.einsum('ki,ki->k', toward, usual).real
    off = [np.einsum('ki,ki->k', toward, transfer(values + step * one) - usual) / power / step
           for one, step in zip(np.eye(len(values)), steps)]
    return np.array(off).T, power / power.sum()


def _values(side):
    """Return the errors of the numbers of a model where a Side stands, (m,)."""
    return np.array(side.simulator.spacecraft.calibration.values)


def _of_errors(change, here, side, fitted):
    """Return a change, (m,) for errors of 1, at the most probable ones, and its deviation."""
    # the record narrows the errors down
    errors, frame = side.errors, side.simulator.frame
    shown = frame.segments / frame.inflation * np.diag(errors.products)
    every = side.prior.root.T @ change
    seen = errors.into @ side.prior.root @ every
    probable = dict(zip(side.uncertainty.names, side.uncertainty.of(fitted)))
    return (float(seen @ [probable[name] for name in errors.names]
                  + change @ (_values(side) - _values(here))),
            float(np.sqrt(max(every @ every - seen ** 2 @ (shown / (1 + shown)), 0.0))))
