"""
The uncertainty of a nominal model: small errors that are no effect, eq. (116) to (118).

Gains of sensors, stiffness of arrays, single frequencies and the step of an integrator differ a
little between two correct models. Each is a direction in the expected spectrum with a Gaussian
prior; all are fitted beside every candidate, so that a gap within them is no gap.
"""
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ssi_ros.effects.edits import mix, scale_stiffness
from ssi_ros.effects.points import dispersed, single_modes, with_mode
from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.gap.inference.whittle import whiten
from ssi_ros.hermitian import hermitian, inverse_root, white_vectors
from ssi_ros.model.errors import with_frequencies
from ssi_ros.model.excitation import Filtered, steadied
from ssi_ros.updating.merged_bins import merged_bins, MergedBins
from ssi_ros.updating.probable_errors import ErrorLikelihood, factors, most_probable, seen
from ssi_ros.updating.slopes import matrix_changes, plain_slopes

STEP = 1e-4             # relative change for a difference quotient


@dataclass(frozen=True, eq=False)
class ModelUncertainty:
    """Whitened directions of model errors, in units of their standard deviations."""

    names: tuple            # what each is
    vectors: np.ndarray     # (n, k l l), change of the whitened spectrum by one, single precision
    offset: np.ndarray = 0.0    # (n,), where the model stands already, from the prior's mean
    into: np.ndarray = None     # (n, m), from errors of the model's numbers to these directions
    heights: object = ()        # Heights of modes in this record: the last ones, if there are any
    beside: dict = field(default_factory=dict)  # what a record of a weight tells of the errors

    @cached_property
    def products(self):
        """Return the products of the vectors with each other, (n, n)."""
        return (self.vectors @ self.vectors.T).astype(float)

    def change(self, errors):
        """Return the change of the whitened spectrum by errors (n,), (k l l)."""
        return (errors.astype(self.vectors.dtype) @ self.vectors).astype(float)

    @property
    def centred(self):
        """Return the same with the mean of the prior where the model stands."""
        return replace(self, offset=np.zeros(len(self.names)))

    def and_of(self, other):
        """Return the directions of both, those of `other` with errors of the model's numbers."""
        into = self.into if self.into is not None else np.zeros(
            (len(self.names), other.into.shape[1]))
        return ModelUncertainty(self.names + other.names,
                                np.concatenate([self.vectors, other.vectors], dtype=np.float32),
                                np.append(self.offset + np.zeros(len(self.names)), other.offset),
                                np.concatenate([into, other.into]), other.heights)

    def moves(self, shift):
        """Return what a shift of the errors of the model's numbers, (m,), is in directions."""
        return self.into @ shift if np.any(shift) else np.zeros(len(self.names))

    def shifted(self, shift):
        """Return the same around a model whose errors are shifted."""
        return replace(self, offset=self.offset + self.moves(shift)) if np.any(shift) else self

    def of(self, fitted):
        """Return the errors (n,) of a Fit beside which these were fitted, else none."""
        return fitted.errors if len(fitted.errors) == len(self.names) else np.zeros(
            len(self.names))

    def taken_out(self, whitened):
        """Return a Whitened around the most probable heights of modes."""
        return self.heights.taken_out(whitened) if self.heights else whitened

    def raised(self, model, evidence):
        """Return what a model expects, (a, k, l, l), with the most probable heights of modes."""
        # how high a slow mode stands in one record is no gap
        return self.heights.raised(model, whiten(model, evidence)) if self.heights else model

    def profile(self, whitened, start=None):
        """
        Return gain of the log likelihood by model errors, their values (n,) and (F + 1)^-1, (117).

        Heights have to be `taken_out` of the record. `start` are errors near by, (n,).
        """
        if not self.names:
            return 0.0, np.zeros(0), np.zeros((0, 0))
        known = self._beside(whitened)
        # heights stand at their best without errors: from there they go on beside them
        offset = self.offset + np.append(
            np.zeros(len(self.names) - len(whitened.heights)), whitened.heights)
        gain, most = most_probable(ErrorLikelihood(known.merged, offset, whitened),
                                   known.information, np.ones(len(self.names), bool), start)
        return gain, most, known.covariance

    def left(self, whitened):
        """Return the covariance of the errors that a record leaves, (n, n)."""
        return self._beside(whitened).covariance

    def _beside(self, whitened):
        """Return what a record of so many periodograms of channels tells, a _Known."""
        weight, count = whitened.weight * len(whitened.excess), whitened.lower.shape[-1]
        if weight not in self.beside:
            shown, bins = weight * self.products, self.vectors.shape[1] // count ** 2
            information = shown + np.eye(len(shown))
            self.beside[weight] = _Known(information, np.linalg.inv(information),
                                         merged_bins(self.vectors, bins, weight, shown))
        return self.beside[weight]

    def seen(self, whitened, most):
        """
        Return the excess (a, k l l) whose product with a direction is the slope along it.

        The model has the factor L R, R that of errors (n,). A change moves L by L K, K lower
        triangular, K + K^H what is whitened of it: the slope is 2 Re tr(K R (X - 1) R^-1) with
        X = R^-1 (1 + E) R^-H, the record whitened by all.
        """
        count, shape = whitened.lower.shape[-1], whitened.excess.shape
        out = np.empty((shape[0], shape[1] // count ** 2, count, count))
        change = np.zeros(out.shape[1:])
        if self.names:
            merged = self._beside(whitened).merged
            change = np.repeat(merged.change(most), merged.counts, axis=0).reshape(change.shape)
        seen(change, whitened.excess.reshape(out.shape), out)
        return out.reshape(shape)

    def mixed(self, whitened, directions):
        """Return the information of directions (p, a, k l l) with each of these, (p, n)."""
        if not self.names:
            return np.zeros((len(directions), 0))
        merged, count = self._beside(whitened).merged, whitened.lower.shape[-1] ** 2
        of_all = directions.sum(axis=1).reshape(len(directions), -1, count)
        return whitened.weight * (merged.vectors @ merged.sums(of_all, 1).reshape(
            len(directions), -1).astype(merged.vectors.dtype).T).T.astype(float)

    def _factors(self, most, count):
        """Return the factors R of errors (n,), (k, l, l)."""
        return factors(hermitian(self.change(most).reshape(-1, count, count)))

    def errors(self, values):
        """Return values (n,) with those of heights, which are no errors of the model, as 0."""
        count = len(self.heights)
        return np.append(values[:len(values) - count], np.zeros(count))

    def corrected(self, model, most):
        """Return the model with errors (n,) in it."""
        values = self.errors(most)
        if not values.any():
            return model
        # the factor that the record was whitened by: another may fail where this one does not
        factor = np.linalg.inv(inverse_root(model)) @ self._factors(values, model.shape[-1])
        return factor @ factor.conj().swapaxes(-1, -2)


class _Known(NamedTuple):
    """What a record tells of errors: information with the prior's, its inverse, bins for them."""

    information: np.ndarray     # (n, n)
    covariance: np.ndarray      # (n, n)
    merged: MergedBins


def no_uncertainty(frame, channels):
    """Return the uncertainty of an exact model."""
    return ModelUncertainty((), np.zeros((0, (frame.last - frame.first) * channels ** 2),
                                         np.float32))


def model_uncertainty(simulator, candidate, levels, settings):
    """Return the ModelUncertainty around a candidate at levels; settings give the deviations."""
    # hinges are linearised once: so small a change of the rest leaves them as they are
    setup = linearise(simulator.setup(candidate, levels))
    setup = replace(setup, drift=0.0, system=replace(setup.system, excitation=tuple(
        map(steadied, setup.system.excitation))))
    base = simulator.spectrum(setup).at(levels)
    lower = inverse_root(base)
    moves = {name: (moved, size) for name, moved, size in _moves(setup, settings) if size > 0.0}
    if not moves:
        return no_uncertainty(simulator.frame, base.shape[-1])
    known = _of_structure(simulator, setup, levels, moves, lower)

    def change(name, moved):
        """Return the whitened change by a unit of the number, (k l l,)."""
        if name in known:
            return known[name]
        return white_vectors(lower, simulator.spectrum(moved).at(levels) - base).mean(
            axis=0) / STEP
    return ModelUncertainty(tuple(moves), np.array(
        [size * change(name, moved) for name, (moved, size) in moves.items()], np.float32))


def _of_structure(simulator, setup, levels, moves, lower):
    """Return by name what `change` is of moves of the structure, where the spectrum is plain."""
    system = setup.system
    moved = {name: m.system for name, (m, _) in moves.items()
             if m.system.stiffness is not system.stiffness}
    plain = moved and plain_slopes(simulator, levels, np.ones(len(moved)), changes=(
        *matrix_changes(system, moved.values(), STEP), np.zeros((len(moved), lower.shape[-1]))),
        setup=setup)
    return dict(zip(moved, plain.whitened(lower[0]))) if plain else {}


def _moves(setup, settings):
    """Yield name, setup with the number moved by STEP, and its standard deviation."""
    channels = setup.system.channels
    for i, channel in enumerate(channels):
        matrix = np.eye(len(channels))
        matrix[i, i] += STEP
        yield f'gain of {channel}', mix(setup, matrix), settings.gain_std
    arrays = [a.name for a in setup.spacecraft.arrays]
    for array in arrays:
        yield (f'stiffness of {array}', replace(setup, system=scale_stiffness(
            setup.system, [array], 1 + STEP)), settings.stiffness_std)
    if not arrays:
        moved = {f'frequency of mode {n}': (with_mode(setup.system, n, 1 + STEP),
                                            settings.frequency_std)
                 for n, _ in single_modes(setup.system)}
        moved['dispersion'] = dispersed(setup.system, STEP), settings.dispersion_std
        yield from ((k, replace(setup, system=s), std) for k, (s, std) in moved.items())
        return
    for kind, (_, std) in setup.spacecraft.excitation.corners.items():
        yield f'colour of {kind}', _recoloured(setup, kind), std
    modes = max(a.modes for a in setup.spacecraft.arrays)
    for mode in range(modes):
        factors = {f'{a}_eta{mode + 1}': 1 + 2 * STEP for a in arrays}
        yield (f'frequency of mode {mode + 1}', _scaled(setup, factors), settings.frequency_std)
    # An integrator with a step or a mesh errs by the square of the frequency.
    squares = {d: setup.system.stiffness[i, i] for i, d in enumerate(setup.system.dofs)
               if '_eta' in d}
    top = max(squares.values())
    factors = {d: 1 + 2 * STEP * k / top for d, k in squares.items()}
    yield 'error that grows with frequency', _scaled(setup, factors), settings.dispersion_std


def _recoloured(setup, kind):
    """Return the setup with the corners of torques, or of process noise, multiplied."""
    parts = tuple(p.scaled(1 + STEP) if isinstance(p, Filtered) and p.name.startswith(kind) else p
                  for p in setup.system.excitation)
    return replace(setup, system=replace(setup.system, excitation=parts))


def _scaled(setup, factors):
    """Return the setup with the diagonal stiffness of freedoms multiplied."""
    scale = np.sqrt([factors.get(d, 1.0) for d in setup.system.dofs])
    return replace(setup, system=with_frequencies(setup.system, scale))
