"""A calibrated model beside a record: its errors are linear around each explanation."""
import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit_again, STEPS
from ssi_ros.gap.inference.whittle import whiten
from ssi_ros.gap.nominal.distant import is_near
from ssi_ros.gap.nominal.model_answer import fit_of
from ssi_ros.gap.nominal.model_comparison import ModelComparison
from ssi_ros.updating.prior import relinearised, stand
from ssi_ros.updating.slopes import is_plain
from ssi_ros.updating.transfer_doubt import beside_errors

ROUNDS = 2              # in which errors move with a candidate
NEAR = 10.0             # nats of an effect that changes a spectrum too little to matter


class CalibratedComparison(ModelComparison):
    """
    A ModelComparison each of whose fits stands on a Side.

    An error moves a resonance where an effect has put it, and no line at all. What the errors
    change around the model without effects is another thing beside a large effect; so directions
    are made anew around it, and the candidate is fitted beside those.
    """

    def __init__(self, *of):
        self._sides = {}
        super().__init__(*of)

    def side(self, fit):
        """Return the Side that a fit stands on."""
        return self._sides.get(id(fit.state), (None, self.here))[1]

    def log_prior_ratio(self, fit):
        """Return the log of posterior over prior volume, that of errors around a fit included."""
        volume = self._sides[id(fit.state)][2] if id(fit.state) in self._sides else 0.0
        return super().log_prior_ratio(fit) + volume

    def detected_beside(self, ranked, detections):
        """Return detections as they are beside the errors of a candidate."""
        fit = ranked.fit
        return tuple(beside_errors(d, self.found_on(fit), self.null.state, self.side(fit),
                                   fit.state) if d.effect in ranked.names else d
                     for d in detections)

    def found_on(self, fit):
        """Return the Side that the detections of a candidate were found beside."""
        return self.here

    def _fit(self, candidate, start, fold, thorough):
        start = start or self.null
        found, side = super()._fit(candidate, start, fold, thorough), self.side(start)
        if found is None:
            return None
        if thorough and fold is None and candidate.effects and (
                found.log_likelihood - self.null.log_likelihood > NEAR) and is_near(self, found):
            return self._around(found, side)
        return self._standing(found, side)

    def _standing(self, found, side, volume=0.0):
        """Return a fit, its side kept, and the log of the volume of errors over the usual one."""
        self._sides[id(found.state)] = found, side, volume
        return found

    def _around(self, found, side):
        """Return a fit beside errors around its own candidate, where they are most probable."""
        best, spectra = self._standing(found, side), self.record.spectra
        whitened = whiten(best.state.plain, spectra)
        for _ in range(ROUNDS):
            candidate, levels = best.candidate, best.levels
            moved = relinearised(side, whitened)
            simulator, prior = moved or (side.simulator, side.prior)
            around = candidate if is_plain(simulator, levels, candidate) else Candidate()
            if simulator.expected(around, levels) is None or (
                    moved is None and side.candidate.kinds == around.kinds):
                break
            side = stand(simulator, prior, levels, self.settings, around)
            state = fit_again(simulator, spectra, best.state, STEPS, side.uncertainty)
            if state is None:
                break
            whitened = whiten(state.plain, spectra)
            volumes = [np.linalg.slogdet(s.uncertainty.left(whitened))[1] / 2
                       for s in (side, self.here)]
            best = self._standing(fit_of(state, side), side, volumes[0] - volumes[1])
        return best
