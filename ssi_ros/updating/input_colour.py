"""
The colour of the excitation, which a healthy recording shows and a model rarely states.

Torques and the forces on the modes each pass a first-order low-pass, the shaping filter of section
4.2 of the paper. Taken for white, a low-pass that is not stated bends every resonance and
antiresonance of a wide band, which no error of a structure does. Eq. (29a) of docs/theory.md,
(194) of docs/theory-gap.md.
"""
from dataclasses import dataclass, replace
import math

import numpy as np

from ssi_ros.effects.base import Effect, Site
from ssi_ros.gap.candidate import Candidate
from ssi_ros.quantity import quantity
from ssi_ros.updating.fit import fit_errors

CLEAR = 5.0             # nats of evidence, from which errors are fitted anew under a colour
WHITE = 10.0            # corners so many times the rate change a power by less than 0.3 %
TRIED = 4               # steps of a first fit
VAGUE = 1.0             # deviation of the logarithm of a corner that says nothing of it
MOST_STD = 2.0          # which a deviation is kept below: the same one in power, by a lower corner
BEGIN = 1.0             # of the rate: a fifth less power at the highest frequency there is


@dataclass(frozen=True)
class InputColour(Effect):
    """Corners of torques and of the forces on the modes: a property of a model, no effect."""

    name = 'input_colour'
    site = Site.EXCITATION
    size = 'torque_corner_hz'
    starts = {'torque_corner_hz': (60.0,), 'process_corner_hz': (60.0,)}
    power = -2.0

    torque_corner_hz: float = quantity(math.inf, unit='Hz', low=1e-6, doc='corner of the torques')
    process_corner_hz: float = quantity(math.inf, unit='Hz', low=1e-6, doc='of the forces')

    def spacecraft(self, spacecraft):
        """Return the spacecraft with these colours."""
        return replace(spacecraft, excitation=replace(
            spacecraft.excitation, torque_corner_hz=self.torque_corner_hz,
            process_corner_hz=self.process_corner_hz))


def with_colour(spacecraft, samples, found, settings, **beside):
    """
    Return a model with the colours that its excitation has in recordings, and its ErrorFit there.

    Parameters
    ----------
    spacecraft : Spacecraft
        The model, its excitation as it states it.
    samples : sequence of Samples
        Healthy recordings, as for `fit_errors`.
    found : ErrorFit
        Of its errors, under that excitation.
    settings : DiagnosisSettings
        Segments and band.
    beside
        Other arguments of `fit_errors`.

    Returns
    -------
    spacecraft : Spacecraft
        As it was, where no colour is more likely, or where it states one.
    found : ErrorFit

    """
    # A colour of which recordings say little is kept with what they leave unknown of it: white and
    # certain it would be an effect in the next one.
    stated = spacecraft.excitation
    if any(np.isfinite(corner) for corner, _ in stated.corners.values()):
        return spacecraft, found
    begin = BEGIN * spacecraft.rate_hz
    colour = Candidate((InputColour(begin, begin),))

    def fitted(candidate, **how):
        return fit_errors(spacecraft, samples, found.names, found.stds, settings,
                          candidate=candidate, **beside, **how)
    near = fitted(colour, before=found, steps=TRIED)
    if near.log_likelihood < found.log_likelihood:
        return spacecraft, found
    best = near
    if near.log_evidence - found.log_evidence > CLEAR:
        # errors that were fitted under another colour have taken up some of it
        best = max(near, fitted(near.candidate), key=lambda f: f.log_likelihood)
    effect, = best.candidate.effects
    corners = np.array([effect.torque_corner_hz, effect.process_corner_hz])
    stds = np.sqrt(np.diag(best.of_candidate))
    # what a deviation of the logarithm does to the power goes with 1 / corner^2
    most = np.minimum(stds, MOST_STD)
    corners, stds = [[float(v) for v in x] for x in (corners * np.sqrt(most / stds), most)]
    return replace(spacecraft, excitation=replace(
        stated, torque_corner_hz=corners[0], process_corner_hz=corners[1],
        torque_corner_std=stds[0], process_corner_std=stds[1])), replace(
            best, candidate=Candidate(), of_candidate=np.zeros((0, 0)))


def words(spacecraft):
    """Return a sentence for every colour of the excitation of a model."""
    names = {'torque': 'the torque has', 'process': 'the forces on the modes have'}
    return tuple(
        f'{names[kind]} passed a low-pass of first order with its corner at {corner:.3g} Hz '
        f'(+-{100 * std:.1f} %)'
        for kind, (corner, std) in spacecraft.excitation.corners.items()
        if corner < WHITE * spacecraft.rate_hz and std < VAGUE)
