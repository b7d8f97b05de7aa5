"""Nonlinear forces between the points of a model, beside a fit."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.base import Site
from ssi_ros.effects.places import offered
from ssi_ros.effects.points import held_pairs, row_between
from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.gap.comparison import Detection
from ssi_ros.open_set.force_between import FAMILIES, findings_between, forces_between
from ssi_ros.open_set.spectra import record_spectra

LEAST = 0.05            # p-value: what is more probable is nothing


def is_linear_and_steady(name):
    """Return whether an effect leaves Gaussian motion Gaussian, and a structure as it is."""
    effect = effect_class(name)
    return effect.spectral and not effect.nonlinear and (
        ModalPattern.FREQUENCY_DRIFT not in effect.patterns)


def is_linear_side(simulator):
    """Return whether all that a model side knows is linear, and its healthy recordings are."""
    return not (simulator.recorded or simulator.spacecraft.calibration.unexplained) and all(
        is_linear_and_steady(e.name) for e in simulator.present)


def has_joints(model):
    """Return whether forces between points of a model reach its channels."""
    return 'points' in offered(model) and model.quadrature is None


def joint_forces(simulator, fitted, inputs, channels, asked=FAMILIES):
    """
    Return the Detections of nonlinear forces between points of a model, eq. (188d).

    Parameters
    ----------
    simulator, fitted : Simulator, Fit
        Of a linear model, and of effects that are linear or nonlinear forces themselves; there is
        no Detection of others.
    inputs : Reconstruction
        Of the record.
    channels : sequence of str
        Their names.
    asked : sequence of str
        Families: all that are found, or none where none of them is asked.

    """
    model = simulator.spacecraft
    if not set(FAMILIES) & set(asked) or not (
            has_joints(model) and is_linear_side(simulator)) or not all(
            is_linear_and_steady(n) or effect_class(n).nonlinear for n in fitted.candidate.names):
        return ()
    if not (held := held_pairs(model)):
        return ()
    kept = np.zeros(inputs.rows)
    kept[inputs.recorded] = 1 / (inputs.taper * np.sqrt(inputs.rows))[inputs.recorded]
    system, rows = _linear(simulator.setup(fitted.candidate, fitted.levels), held)
    z = forces_between(
        system, record_spectra(system, fitted.levels, inputs, channels), rows, kept)
    return tuple(Detection('', {}, f.p_value, f.text, basis=f.family, site=Site.STRUCTURE.value)
                 for f in findings_between(z, held) if f.p_value < LEAST)


def _linear(setup, between):
    """Return the System of a Setup whose laws are linearised, and rows of pairs of its points."""
    system = setup.system
    rows = np.array([row_between(setup, *pair) for pair in between])
    if not setup.laws:
        return system, rows
    # what is linearised may have other freedoms, which inputs follow
    names = tuple(map(' and '.join, between))
    system = linearise(replace(setup, system=replace(
        system, input=np.hstack([system.input, rows.T]),
        inputs=system.inputs + tuple(f'force between {n}' for n in names)))).system
    own = len(system.inputs) - len(rows)
    return replace(system, input=system.input[:, :own], inputs=system.inputs[:own]), (
        system.input[:, own:].T)
