"""
What a diagnosis needs of a nominal: the records that pass between the stages, and the protocol.

A nominal is what is believed before the record is looked at: a model, or an earlier recording. Set
beside a record it is a `Comparison`. The driver knows only what stands in this file, so that one
driver serves every nominal.
"""
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

LEAST_CHANCE = 1e-300   # p-values below are beyond what a number can say


@dataclass(frozen=True, eq=False)
class Detection:
    """Something that a test of its own found in a record."""

    effect: str                 # that it speaks for; empty where none of the library makes it
    parameters: dict            # its quantities at the size detected, by name [their units]
    p_value: float              # chance of it where nothing is wrong, after the trials factor
    text: str                   # one sentence: what was found, with size and unit
    stds: dict = field(default_factory=dict)    # standard deviations of those that have one
    trials: int = 1             # independent places or sizes searched, paid for in `p_value`
    times: tuple = ()           # two arrays (n,): instants of events [s], their probabilities
    weak: bool = False          # too small to be a gap by itself; it may still explain one
    site: str = ''              # of a Site, where no effect says it
    basis: Any = None           # what the nominal that made it turns into a candidate

    @classmethod
    def of_effect(cls, effect, p_value, text, **more):
        """Return the detection of an effect at its values, which is also its basis."""
        return cls(effect.name, effect.values(), p_value, text, basis=effect, **more)

    @property
    def log_odds(self):
        """
        Log of the largest Bayes factor that the p-value allows, -log(-e p log p).

        Sellke, Bayarri and Berger, The American Statistician 55, 2001; 0 where it speaks for none.
        """
        log_p = float(np.log(max(self.p_value, LEAST_CHANCE)))
        return -log_p - 1.0 - float(np.log(-log_p)) if log_p < -1.0 else 0.0


@dataclass(frozen=True, eq=False)
class ScoreTest:
    """Scores of every template around a fit, nuisances projected out."""

    labels: tuple               # (t,), what each is of: an effect at a place, or a modal form
    owners: tuple               # (t,), tuples of the names of effects that each speaks for
    z: np.ndarray               # (t,), standardised: Gaussian of variance 1 if the fit is right
    one_sided: np.ndarray       # (t,), whether only a positive score can be the effect's
    gains: np.ndarray           # (t,), gain of the log likelihood that each promises
    p_value: float              # chance of so large a score anywhere
    state: Any = None           # what the nominal that made it needs to go on from here


@dataclass(frozen=True, eq=False)
class GapStatistic:
    """How far a record is from an expected spectrum, eq. (101)."""

    value: float                # mean over the bands of D [nats]
    floor: float                # its mean where the expected spectrum is right
    floor_std: float            # and its standard deviation there
    bands: np.ndarray = None    # (b,), D of every band less its floor
    edges_hz: np.ndarray = None     # (b + 1,), between the bands [Hz]

    @property
    def deviations(self):
        """Return the standard deviations by which the gap exceeds its floor."""
        return (self.value - self.floor) / self.floor_std


@dataclass(frozen=True, eq=False)
class Fit:
    """A candidate at its most likely values."""

    candidate: Any              # fitted: `Candidate`, `ModalCandidate` where without geometry
    estimate: np.ndarray        # (p,), coordinates of its quantities
    covariance: np.ndarray      # (p, p), levels and uncertain numbers of the nominal profiled out
    log_likelihood: float       # at the fit, with the prior of uncertain numbers; compared only
    levels: np.ndarray          # of the inputs and of the noise, power over nominal
    state: Any = None           # what the nominal that made it needs to go on from here


@dataclass(frozen=True, eq=False)
class Location:
    """
    Where the gap lies; what the nominal cannot know is None.

    Every row is a dict with `share` and `p_value`; shares of a table add up to 1 or less.
    """

    sensors: tuple              # `name`; `p_value` where there is one
    bands: tuple                # `low_hz`, `high_hz`
    modes: tuple                # `frequency_hz`, `name`; largest share first
    times: tuple                # `start_s`, `end_s`
    amplitudes: tuple = None    # `low_m_s2`, `high_m_s2`
    site: dict = field(default_factory=dict)    # share by site; filled in by the conclusion


@dataclass(frozen=True, eq=False)
class Residual:
    """What a fit leaves: all tests of the record against it, joined to one p-value."""

    score_test: ScoreTest       # None where the nominal has none around such a fit
    detections: tuple           # `Detection`s of the effects that the fit does not hold
    anomalies: tuple            # and of what no effect of the library makes
    gap: GapStatistic           # of all segments
    p_value: float              # of all tests together
    spectral_p_value: float     # the same without detections that show in no spectrum
    floor: Any = None           # what the fit leaves of records that it simulates, if needed


class Comparison(Protocol):
    """
    A nominal beside a record: what a diagnosis asks of it.

    What has a default is of nominals that can be simulated: others need not write it.
    """

    kind: str                   # 'model' or 'reference', for messages
    effects: tuple              # names that are considered
    null: Fit                   # levels alone
    notes: tuple                # what was left out or changed, in sentences
    mismatch: str               # why record and nominal cannot be compared; empty if they can
    site: str = ''              # where they differ, if known whatever explains it

    # test
    def residual(self, fit: Fit) -> Residual:
        """Run all tests of the record against a fit: scores, detectors, goodness of fit."""

    def goodness_of_fit(self, fit: Fit, fold: int = None) -> GapStatistic:
        """Measure the gap of all segments, or of those outside one of two folds."""

    def localise(self, fit: Fit = None, probability: float = 0.0) -> Location:
        """
        Return where the gap lies; with a fit, what it changes counts by its probability.

        With a fit, `sensors` may be empty: those of the null fit then stand.
        """

    # search
    def candidates(self, residual: Residual) -> tuple:
        """Return the candidates, single effects at starting values, that the tests speak for."""

    def all_candidates(self) -> tuple:
        """Return all starting values of all effects, of which a control is drawn."""

    def refinements(self, ranked: list) -> tuple:
        """Return candidates that contain the best one, or compete with it for the same reason."""

    def equivalents(self, ranked: list, residual: Residual) -> tuple:
        """Return candidates that the best one may stand for, by what that leaves."""
        return ()

    def distant(self, ranked: list) -> tuple:
        """Return candidates far from every start, for a residual that no small size explains."""
        return ()

    def anywhere(self, residual: Residual, beside: Fit = None) -> tuple:
        """Return candidates of any effect and size beside a fit, of a `residual` that is large."""
        return ()

    def corrected(self, ranked: list) -> list:
        """Correct candidates whose expected spectrum is approximate."""
        return ranked

    def pairs(self, found: Residual, residual: Residual, ranked: list) -> tuple:
        """Return candidates of two effects, after the best single one left `residual`."""

    def indistinguishable(self, found: Residual, candidate) -> tuple:
        """Return candidates that the data can hardly distinguish from one."""
        return ()

    def below_the_band(self, detection: Detection) -> bool:
        """Return whether a detection lies at frequencies that no fit uses."""
        return getattr(detection.basis, 'below_band', False)

    # fit
    def fit(self, candidate, start: Fit = None, fold: int = None, thorough: bool = True) -> Fit:
        """Fit a candidate to all segments, or to one of two folds; None if it cannot exist."""

    def bonus(self, fit: Fit, detections: tuple) -> float:
        """Return the log odds of detections beyond what the spectrum has of them already."""

    def log_prior_ratio(self, fit: Fit) -> float:
        """Return the log of posterior over prior volume of quantities and places, eq. (112)."""

    def estimate(self, fit: Fit, residual: Residual) -> Any:
        """Return the indirect-inference estimate that goes with a fit, or None."""
        return None

    def simulated_floor(self, fit: Fit) -> Any:
        """Return what a fit leaves of records that it simulates, or None."""
        return None

    # answer
    def own_error(self, ranked) -> bool:
        """Return whether an error that the nominal declares would look like a candidate."""
        return False

    def elsewhere(self, fit: Fit) -> str:
        """Return the site that what a fit leaves speaks for, whatever it is of, or None."""
        return None

    def alike(self, found: Residual, ranked) -> tuple:
        """Return the names of a candidate, and of effects that cannot be distinguished from it."""

    def detected_beside(self, ranked, detections: tuple) -> tuple:
        """Return detections as they are beside a candidate, errors of the nominal included."""
        return detections

    def parameters(self, ranked, detections: tuple) -> dict:
        """Return the quantities of a candidate with their intervals, by `effect.quantity`."""

    def built(self, ranked, detections: tuple) -> tuple:
        """Return the effects of a candidate as a simulator has to be given them; may be empty."""
        return ()
