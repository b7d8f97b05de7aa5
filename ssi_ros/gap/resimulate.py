"""
The floor by simulation: what a fitted candidate leaves of records that it made itself, (119).

The expected spectrum of a nonlinear hinge, of rails or of a drift is an approximation. What it
leaves of a simulated record is not held against a candidate.
"""
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from ssi_ros.gap.fit import fit_again
from ssi_ros.gap.indirect import records
from ssi_ros.gap.meter import measure
from ssi_ros.gap.rank import above_floor, folds
from ssi_ros.gap.scores import directions, score
from ssi_ros.gap.slow import slow_signs
from ssi_ros.gap.strange import strange_directions, strange_scores, strange_sign
from ssi_ros.gap.swings import wander
from ssi_ros.gap.symptoms import SURE
from ssi_ros.gap.torque import odd_signs, reconstruct, torque_signs

RECORDS = 5
REFIT_STEPS = 3
TRUST = 3.0             # records that the scatter of all scores together counts for
SEED = 9_000_000        # far from seeds that records are made with


@dataclass(frozen=True, eq=False)
class Floor:
    """
    What a candidate leaves of its own records.

    Attributes
    ----------
    z : ndarray, shape (t,)
        Mean of the scores.
    deviations, spread : float
        Mean and standard deviation, at least 1, of the meter over the records, in standard
        deviations of its floor from theory.
    halves, spread_of_halves : float
        The same of both halves of the pieces, each measured alone as held-out ones are.
    whitened : ndarray, shape (b, l, l)
        Mean of the whitened bands.
    crowding : float
        How much more they scatter than those of a steady record, at least 1: where the level
        swings within a piece, its bins repeat each other.
    scatter : ndarray, shape (t,)
        Standard deviation of the scores over the records, drawn to that of all together; at
        least 1. Holes leak into all bins alike, so that scores of noise scatter more than
        independent bins would.
    strange : tuple of ndarray, shape (s,)
        Mean and standard deviation of the scores of strangers, alike.
    signs : dict of str to list of float
        p-values of the signs of the records, by effect or name.
    wander : ndarray
        How much the level of a nonlinear candidate wanders about the period of the swing that
        the record shows, 1 in the mean where it does not; empty for others.
    lost : float
        Log likelihood that the candidate loses on them: by its expected spectrum, and by chance.
    wider : ndarray, shape (p,)
        How much more fits of a nonlinear candidate scatter than their covariance says, at
        least 1: what its motion does by chance is no noise of an equivalent linear hinge.

    """

    z: np.ndarray
    deviations: float
    spread: float
    halves: float
    spread_of_halves: float
    whitened: np.ndarray
    crowding: float
    scatter: np.ndarray
    strange: tuple
    signs: dict
    lost: float
    wander: np.ndarray
    wider: np.ndarray

    def against(self, scores, strange, meter, signs, odd):
        """Return scores, p-values of the meter, and both kinds of signs, against this floor."""
        spread = np.sqrt(1 + 1 / RECORDS)
        mean, scatter = self.strange
        strange = replace(strange, z=(strange.z - mean) / scatter / spread)
        return (replace(scores, z=(scores.z - self.z) / self.scatter / spread),
                (float(norm.sf((meter.deviations - self.deviations) / self.spread / spread)),
                 meter.local_p_value(self.whitened, spread ** 2 * self.crowding)),
                tuple(s for s in map(self.sign, signs)
                      if s.p_value <= SURE and not self.shows(s.effect.name, s.p_value)),
                tuple(s for s in odd if not self.shows(s.name, s.p_value)) + strange_sign(strange))

    def sign(self, sign):
        """Return a sign with the p-value that it has where the level wanders."""
        if not (sign.look and len(self.wander)):
            return sign
        gain, cells = sign.look
        # powers of noise over their mean of so many looks
        looks = len(self.wander)
        own = looks * max(1.0, float(self.wander.mean()))
        return replace(sign, p_value=min(1.0, cells * (1 + gain / own) ** -looks))

    def shows(self, name, p_value):
        """Return whether two of the records show a sign, or one as strongly."""
        seen = self.signs.get(name, ())
        return len(seen) > 1 or any(p <= p_value for p in seen)


def floor_by_simulation(simulator, best, made, templates, strangers, tolerance, settings,
                        signs=(), odd=False):
    """
    Simulate a fitted candidate and look at what it leaves of its own records.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    best : Fit
        The candidate.
    made : Made
        What it is simulated with.
    templates, strangers, tolerance, settings
        As for the record.
    signs : sequence of Symptom
        Of the record, which are looked for.
    odd : bool
        Whether signs of nothing in the library are looked for too.

    Returns
    -------
    Floor

    """
    z, strange, meters, halves, seen, wanders, points = [], [], [], [], {}, [], []
    here, names = None, tuple(s.effect.name for s in signs)
    stds = np.sqrt(np.maximum(np.diag(best.covariance), 1e-300))
    nonlinear = best.candidate.nonlinear
    for samples, evidence in records(simulator, made, SEED, RECORDS):
        again = fit_again(simulator, evidence, best, REFIT_STEPS, tolerance)
        points.append(again.candidate.point())
        # all five fits are near each other: templates whitened by the first will do
        here = here or (directions(templates, again, evidence, tolerance),
                        strange_directions(strangers, again, evidence, tolerance))
        z.append(score(templates, again, evidence, tolerance, here[0]).z)
        strange.append(strange_scores(strangers, again, evidence, tolerance, here[1]).z)
        meters.append(measure(again.model, evidence, settings.band_bins))
        halves.append(above_floor([measure(again.model, half, settings.band_bins)
                                   for half in folds(evidence)]))
        if names or odd:
            torque = reconstruct(simulator, again, samples, settings)
            found = [(s.effect.name, s.p_value) for s in torque_signs(torque, names)
                     + slow_signs(simulator, again, samples, settings, names)]
            if odd:
                found += [(s.name, s.p_value) for s in odd_signs(torque, samples.channels)]
            wanders += [wander(torque, s.effect.period_s) for s in signs if s.look and nonlinear]
            for name, p_value in found:
                seen.setdefault(name, []).append(p_value)
    deviations = [m.deviations for m in meters]
    whitened = np.mean([m.whitened for m in meters], axis=0)
    # their own mean takes a fifth of the scatter away
    crowding = np.mean([m.ratio(whitened) for m in meters]) / (1 - 1 / RECORDS)
    lost = float(np.mean([m.lost for m in meters]))
    mean, scatter = _drawn(z)
    return Floor(mean, float(np.mean(deviations)),
                 max(1.0, float(np.std(deviations, ddof=1))), float(np.mean(halves)),
                 max(1.0, float(np.std(halves, ddof=1))), whitened, max(1.0, float(crowding)),
                 scatter, _drawn(strange), seen, lost, np.ravel(wanders),
                 _drawn(points / stds)[1] if nonlinear and len(stds) else np.ones(len(stds)))


def _drawn(z):
    """Return mean and standard deviation of scores over records, shape (r, t) to (t,) each."""
    variance = np.var(z, axis=0, ddof=1)
    variance = (TRUST * variance.mean() + (RECORDS - 1) * variance) / (TRUST + RECORDS - 1)
    return np.mean(z, axis=0), np.sqrt(np.maximum(1.0, variance))
