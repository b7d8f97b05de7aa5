"""What a nominal does not know of its own numbers, as directions of its expected spectrum."""
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.hermitian import inverse_root, white_vectors
from ssi_ros.model.errors import declared
from ssi_ros.tails import chi2
from ssi_ros.updating.correlation import heights_of
from ssi_ros.updating.model_uncertainty import model_uncertainty, ModelUncertainty
from ssi_ros.updating.slopes import plain_slopes, slopes

BENT = 0.3              # whitened change beyond which a spectrum is not linear in errors
LEAST = 1e-2            # squared deviations that a direction must make in a record to be kept


@dataclass(frozen=True, eq=False)
class ErrorPrior:
    """
    A Gaussian prior of the errors of a model's numbers, and where the model stands.

    Attributes
    ----------
    names : tuple of str, (m,)
        Errors, those of the calibration of the model.
    root : ndarray, (m, m)
        Root A of the covariance A A^T, in the units of `Calibration.values`.
    offset : ndarray, (m,)
        A^-1 times the values of the model less the mean of the prior.

    """

    names: tuple
    root: np.ndarray
    offset: np.ndarray

    @property
    def log_density(self):
        """Return the log density where the model stands, over that at the mean."""
        return -float(self.offset @ self.offset) / 2


@dataclass(frozen=True, eq=False)
class Side:
    """A model side that fits stand on, made for a candidate at levels; see `stand`."""

    simulator: object
    prior: ErrorPrior       # None of an exact model
    levels: np.ndarray
    settings: object        # DiagnosisSettings
    candidate: Candidate
    log_density: float      # of where its errors stand, and of how wide they may be there
    adapted: object = None  # the Adapted that it was made of

    @cached_property
    def errors(self):
        """Return the directions of its errors, a ModelUncertainty; None of an exact model."""
        return self.prior and error_directions(
            self.simulator, self.levels, self.prior, self.candidate)

    @cached_property
    def heights(self):
        """Return the heights of slow modes, a ModelUncertainty; None of an exact model."""
        if not self.prior:
            return None
        return heights_of(self.simulator, self.candidate, self.levels, len(self.prior.names),
                          self.adapted and self.adapted.fit.correlation)

    def raised(self, model, evidence):
        """Return what a model expects of a record, with the most probable heights of its modes."""
        return self.heights.raised(model, evidence) if self.heights else model

    def chance_of_errors(self, fitted, frame):
        """
        Return the p-value of the errors of a Fit, 1 beside a model that is not calibrated.

        Of standard normal errors the most probable ones have as many squares as the record tells.
        Errors that are improbable have taken up an effect, however well they explain the record.
        """
        if not self.prior or not self.simulator.spacecraft.calibration.covariance:
            return 1.0
        errors = self.uncertainty.errors(self.uncertainty.offset + self.uncertainty.of(fitted))
        products = frame.segments / frame.inflation * self.errors.products
        seen = np.sum(1 - 1 / (1 + np.linalg.eigvalsh(products)))
        return float(chi2.sf(errors @ errors, seen))

    @cached_property
    def uncertainty(self):
        """Return all that the model does not know around its candidate."""
        small = model_uncertainty(self.simulator, self.candidate, self.levels, self.settings)
        return small.and_of(self.errors).and_of(self.heights) if self.errors else small

    def around(self, candidate, levels):
        """Return what the model does not know of its numbers, around a candidate."""
        # errors of a calibration, far larger ones, are those around the model in any case
        return self.uncertainty if self.errors else model_uncertainty(
            self.simulator, candidate, levels, self.settings)


def known_by_recordings(calibration):
    """Return the prior that a calibration leaves: its own values, with its covariance."""
    covariance = np.array(calibration.covariance)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return ErrorPrior(calibration.names, root, np.zeros(len(root)))


def relinearised(side, whitened):
    """
    Return a model side and its ErrorPrior at the most probable errors beside a record.

    A damping that is half of what a calibration gave changes a resonance by more than a linear
    direction says. None where the spectrum is linear in what errors change of it.

    Parameters
    ----------
    side : Side
        Where the model stands.
    whitened : Whitened
        The record by the model with an effect, or without.

    """
    prior, uncertainty = side.prior, side.uncertainty
    values = uncertainty.errors(uncertainty.profile(uncertainty.taken_out(whitened))[1])
    if np.abs(uncertainty.change(values)).max() < BENT:
        return None
    shift = (uncertainty.into @ prior.root).T @ values      # in deviations of the prior
    there = np.array(side.simulator.spacecraft.calibration.values) + prior.root @ shift
    return side.simulator.at_errors(there), replace(prior, offset=prior.offset + shift)


def prior_of(spacecraft):
    """Return what is unknown of a model before any record, an ErrorPrior, or None if exact."""
    if spacecraft.calibration.covariance:
        return known_by_recordings(spacecraft.calibration)
    names, stds = declared(spacecraft)
    return ErrorPrior(names, np.diag(stds), np.zeros(len(stds))) if names else None


def declared_prior(found):
    """Return the declared prior around a model whose errors were fitted: an ErrorFit."""
    return ErrorPrior(found.names, np.diag(found.stds), found.values / found.stds)


def error_directions(simulator, levels, prior, candidate=Candidate()):
    """
    Return the directions in which a prior lets the expected spectrum of a model go.

    Parameters
    ----------
    simulator : Simulator
        The model, its calibration at the values of the prior.
    levels : ndarray
        Of its inputs and its noise.
    prior : ErrorPrior
        What is not known.
    candidate : Candidate
        Effects beside.

    Returns
    -------
    ModelUncertainty
        Orthogonal directions, those that a record of this length would show.

    """
    nominal = simulator.expected(candidate, levels)
    base, frame = nominal.at(levels), simulator.frame
    lower = inverse_root(base)
    sizes = np.maximum(np.linalg.norm(prior.root, axis=1), 1e-12)
    plain = plain_slopes(simulator, levels, sizes, candidate)
    each = plain.whitened(lower[0]) if plain else np.array([
        white_vectors(lower, c).mean(axis=0, dtype=np.float32)
        for c in slopes(simulator, base, levels, sizes, candidate)])
    root, doubled = prior.root / sizes[:, None], each.astype(float)
    information = frame.segments / frame.inflation * (root.T @ (doubled @ doubled.T) @ root)
    squares, turn = np.linalg.eigh(information)
    turn = turn[:, squares > LEAST]
    names = tuple(f'error {i + 1}' for i in range(turn.shape[1]))
    single = np.float32
    vectors = (turn.T @ root.T).astype(single) @ each.astype(single, copy=False)
    return ModelUncertainty(names, vectors, turn.T @ prior.offset,
                            turn.T @ np.linalg.pinv(prior.root))


def stand(simulator, prior, levels, settings, candidate=Candidate(), *, occam=0.0, adapted=None):
    """
    Return the Side of a model whose errors have a prior, made for a candidate at levels.

    `prior` is an ErrorPrior, or None of an exact model; `occam` the log of posterior over prior
    volume of its errors, over that of the side without effects.
    """
    return Side(simulator, prior, levels, settings, candidate,
                (prior.log_density if prior else 0.0) + occam, adapted)
