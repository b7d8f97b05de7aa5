"""
The floor by simulation: a parametric bootstrap of the tests of a fitted candidate, eq. (119).

The expected spectrum of a nonlinear hinge, of clipping or of a drift is an approximation. The
residual that its error leaves in simulated records of the candidate is not held against it.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.bootstrap.indirect_inference import simulated_records
from ssi_ros.events.blocks import search
from ssi_ros.gap.detectors.amplitude_modulation import Modulation, modulation_by_chance
from ssi_ros.gap.detectors.thresholds import LIMITS as DETECTION
from ssi_ros.gap.inference.goodness_of_fit import measure
from ssi_ros.gap.inference.model_fit import fit_again
from ssi_ros.gap.inference.score_test import directions, score
from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.inference.unmodelled.scores import change_directions, detect_change, score_changes
from ssi_ros.gap.selection.evidence import above_floor
from ssi_ros.inputs.beside import remainder
from ssi_ros.levels.held_out import held_out
from ssi_ros.open_set.families import beside, FAMILIES
from ssi_ros.open_set.force_between import beside_simulated, FAMILIES as OF_FORCES
from ssi_ros.tails import norm

RECORDS = 5
REFIT_STEPS = 3
HALF_STEPS = 1          # of a half from the fit of the whole: one is as good as all (Le Cam)
SEED = 9_000_000        # far from seeds that records are made with


@dataclass(frozen=True, eq=False)
class Floor:
    """
    The tests of simulated records of a candidate against its own fits.

    `scatter` is the standard deviation of the scores, shrunk to that of all together, at least 1:
    gaps in the data leak into all bins alike, so that scores of noise scatter more than
    independent bins. `deviations` and `spread`, at least 1, are mean and standard deviation of the
    gap statistic, in standard deviations of its floor from theory; `halves` and `spread_of_halves`
    those of both halves of the segments, each beside a fit to the other one.

    `inflation` is the variance of the distance of the bands over that of a steady record, at least
    1: where the level is modulated within a segment, its bins are correlated. `modulation` is
    that of the level of a nonlinear candidate about the period of that detected in the record, 1
    in the mean where there is none, empty for others. `std_ratio`, at least 1, is the standard
    deviation of fits of a nonlinear candidate over that of their covariance: chance in its motion
    is no noise of an equivalent linear hinge.
    """

    z: np.ndarray           # (t,), mean of the scores
    scatter: np.ndarray     # (t,)
    changes: tuple          # mean and scatter, (s,), of those of unmodelled changes
    deviations: float
    spread: float
    halves: float
    spread_of_halves: float
    whitened: np.ndarray    # (b, l, l), mean of the whitened bands
    inflation: float
    detections: dict        # lists of p-values of those in the records, by name
    deficit: float          # log likelihood lost by the expected spectrum and chance
    modulation: np.ndarray
    std_ratio: np.ndarray   # (p,)

    def against(self, scores, changes, meter, detections, anomalies):
        """Return scores, p-values of the meter, detections and anomalies against this floor."""
        spread = np.sqrt(1 + 1 / RECORDS)
        mean, scatter = self.changes
        changes = replace(changes, z=(changes.z - mean) / scatter / spread)
        return (replace(scores, z=(scores.z - self.z) / self.scatter / spread),
                (float(norm.sf((meter.deviations - self.deviations) / self.spread / spread)),
                 meter.local_p_value(self.whitened, spread ** 2 * self.inflation)),
                tuple(d for d in map(self.with_modulation, detections)
                      if d.p_value <= DETECTION.p_value.value
                      and not self.reproduces(d.effect, d.p_value)),
                self.left(anomalies) + detect_change(changes))

    def left(self, anomalies):
        """Return what simulated records do not show of anomalies, at its p-value beside them."""
        forces = {a.basis: a.p_value for a in anomalies if a.basis in OF_FORCES}
        clearest = min(forces, key=forces.get, default=None)
        found = []
        for a in anomalies:
            if a.basis == clearest:
                p_value = beside_simulated(forces, self.detections, RECORDS)
            else:
                p_value = beside(a.p_value, a.basis, self.detections)
            if a.basis == clearest or a.basis in FAMILIES or not (
                    a.basis in forces or self.reproduces(a.basis, a.p_value)):
                found.append(replace(a, p_value=p_value))
        return tuple(found)

    def with_modulation(self, detection):
        """Return a detection with the p-value that it has where the level is modulated."""
        if not (isinstance(detection, Modulation) and len(self.modulation)):
            return detection
        # powers of noise over their mean of so many
        count = len(self.modulation)
        own = count * max(1.0, float(self.modulation.mean()))
        return replace(detection, p_value=min(
            1.0, detection.trials * (1 + detection.gain / own) ** -count))

    def reproduces(self, name, p_value):
        """Return whether two of the records have a detection, or one as strong."""
        found = self.detections.get(name, ())
        return len(found) > 1 or any(p <= p_value for p in found)


@dataclass(frozen=True, eq=False)
class BootstrapTests:
    """The tests that a record and simulated ones undergo alike."""

    templates: object           # Templates, of effects
    changes: object             # ChangeTemplates, of what is no effect
    uncertainty: object         # ModelUncertainty, fitted beside
    settings: object            # DiagnosisSettings
    detections: tuple = ()      # of the record, to be found again
    anomalies: tuple = ()       # those of no effect, as well

    def found(self, simulator, fitted, samples, filters):
        """Return name and p-value of detections, and modulation by chance, in a record."""
        # simulated records take certainty away: what is not certain is not asked again
        names = tuple(d.effect for d in self.detections if d.p_value <= DETECTION.p_value.value)
        asked = {a.basis for a in self.anomalies if a.p_value <= LIMITS.asked_again.value}
        if not (names or asked):
            return [], []
        if simulator.recorded:
            simulator, samples = remainder(simulator, samples, fitted.levels, fitted.candidate)
        periods = [d.parameters['period_s'] for d in self.detections
                   if isinstance(d, Modulation) and fitted.candidate.nonlinear]
        by_chance = []
        found, odd = search(
            simulator, fitted, samples, self.settings, names, asked=asked, filters=filters,
            also=lambda one: by_chance.extend(modulation_by_chance(one, p) for p in periods))
        return [(d.effect or d.basis, d.p_value) for d in found + odd], by_chance


def bootstrap_floor(simulator, best, estimate, tests):
    """Return the Floor of a Fit: records of its IndirectEstimate tested against their own fits."""
    uncertainty, bins = tests.uncertainty, tests.settings.band_bins
    z, changes, meters, halves, found, modulation, points = [], [], [], [], {}, [], []
    here, filters = None, {}
    for samples, evidence in simulated_records(simulator, estimate, SEED, RECORDS):
        again = fit_again(simulator, evidence, best, REFIT_STEPS, uncertainty)
        points.append(again.candidate.point())
        # all five fits are near each other: templates and filters of the first will do
        here = here or (directions(tests.templates, again, evidence, uncertainty),
                        change_directions(tests.changes, again, evidence, uncertainty))
        z.append(score(tests.templates, again, evidence, uncertainty, here[0], False).z)
        changes.append(score_changes(tests.changes, again, evidence, uncertainty, here[1]).z)
        meters.append(measure(uncertainty.raised(again.model, evidence), evidence, bins))
        # errors of the model that are fitted to a half cost on the other half
        halves.append(above_floor([measure(*held_out(fit_again(
            simulator, half, again, HALF_STEPS, uncertainty), evidence, i), bins)
            for i, half in enumerate(evidence.halves)]))
        named, by_chance = tests.found(simulator, again, samples, filters)
        modulation += by_chance
        for name, p_value in named:
            found.setdefault(name, []).append(p_value)
    deviations = [m.deviations for m in meters]
    whitened = np.mean([m.whitened for m in meters], axis=0)
    # their own mean takes a fifth of the scatter away
    inflation = np.mean([m.ratio(whitened) for m in meters]) / (1 - 1 / RECORDS)
    mean, scatter = _moments(z)
    stds = np.sqrt(np.maximum(np.diag(best.covariance), 1e-300))
    varied = best.candidate.nonlinear and len(stds)
    return Floor(mean, scatter, _moments(changes), float(np.mean(deviations)),
                 max(1.0, float(np.std(deviations, ddof=1))), float(np.mean(halves)),
                 max(1.0, float(np.std(halves, ddof=1))), whitened, max(1.0, float(inflation)),
                 found, float(np.mean([m.lost for m in meters])), np.ravel(modulation),
                 _moments(points / stds)[1] if varied else np.ones(len(stds)))


def _moments(z):
    """Return mean and standard deviation of scores over records, shape (r, t) to (t,) each."""
    pooled, variance = LIMITS.pooled_records.value, np.var(z, axis=0, ddof=1)
    variance = (pooled * variance.mean() + (RECORDS - 1) * variance) / (pooled + RECORDS - 1)
    return np.mean(z, axis=0), np.sqrt(np.maximum(1.0, variance))
