"""A model that may be as wrong as it declares, moved onto the record that it is compared with."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.nominal.simulator import IMPOSSIBLE
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.updating.compensation import Compensation
from ssi_ros.updating.fit import ErrorFit, fit_errors
from ssi_ros.updating.prior import declared_prior
from ssi_ros.updating.slopes import is_plain


@dataclass(frozen=True, eq=False)
class Adapted:
    """A model at the most probable errors of its own, given one record."""

    simulator: object       # Simulator at these errors; candidates keep the modes of the record
    fit: ErrorFit

    @property
    def prior(self):
        """Return what is declared of the errors, and where the model stands."""
        return declared_prior(self.fit)


def adapt(simulator, samples, settings, progress=lambda share: None, *, before=None,
          candidate=Candidate(), steps=None):
    """
    Move a model onto a record, as far as its declared uncertainty makes that probable.

    Parameters
    ----------
    simulator : Simulator
        The model as it is.
    samples : Samples
        The record, without bias and gaps.
    settings : DiagnosisSettings
        Segments and band.
    progress : callable
        Called with the share done.
    before : Adapted, optional
        Where to begin.
    candidate : Candidate
        What the record may have beside; its numbers are fitted together with the errors.
    steps : int, optional
        Of the last stage at most.

    Returns
    -------
    Adapted

    """
    names, stds = declared(simulator.spacecraft)
    start = before and replace(before.fit, values=before.fit.values
                               + before.simulator.shift(candidate))
    found = fit_errors(simulator.spacecraft, [samples], names, stds, settings, before=start,
                       present=simulator.present, candidate=candidate,
                       recorded=(simulator.recorded,), steps=steps, progress=progress)
    return Adapted(_keeping_modes(simulator, names, stds, found.values, found.candidate), found)


def standing(simulator, prior):
    """Return a model side whose errors a prior lets go, before any record; see `prior_of`."""
    if simulator.spacecraft.calibration.covariance:
        return simulator            # known from recordings: too well to move modes
    stds = np.diag(prior.root)
    return _keeping_modes(simulator, prior.names, stds, np.zeros(len(stds)))


def _keeping_modes(simulator, names, stds, values, around=Candidate()):
    """Return a model side at values of its errors, which take back what candidates move."""
    side = simulator.but(spacecraft=replace(
        simulator.spacecraft, calibration=Calibration(names, values)))
    return side.but(compensation=Compensation(side, names, stds, around))


def beside(simulator, samples, settings, before, candidate, steps=None):
    """
    Return the model moved onto a record together with a candidate.

    Parameters
    ----------
    simulator, samples, settings
        As in `adapt`.
    before : Adapted
        Where to begin.
    candidate : Candidate
        With all its effects.
    steps : int, optional
        Of the fit at most; as many as of `fit_errors` by default.

    Returns
    -------
    Adapted or None
        None for a candidate that cannot exist, or whose expected spectrum is not differentiated by
        all errors at once.

    """
    try:
        if is_plain(before.simulator, before.fit.levels[0], candidate):
            return adapt(simulator, samples, settings, before=before, candidate=candidate,
                         steps=steps)
    except IMPOSSIBLE:
        pass
    return None
