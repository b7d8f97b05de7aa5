"""
Fit the errors of a model to recordings: the most probable values, and what remains unknown.

The spectrum of a lightly damped mode says nothing of its frequency to a model that is many line
widths away. So the fit goes from short segments, whose lines are wide, to long ones; each stage
begins where the one before ended, and two schedules of lengths guard each other. Within a stage it
is damped Fisher scoring of the debiased Whittle likelihood with the declared prior, eq. (164) of
docs/theory-gap.md.
"""
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np

from ssi_ros.fisher_scoring import covariance, maximise
from ssi_ros.gap.candidate import Candidate, priors_of
from ssi_ros.gap.inference.model_fit import scales_of
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.selection.evidence import log_prior_ratio
from ssi_ros.gap.spectra.segmentation import frame_of
from ssi_ros.model.errors import Calibration, of_recording
from ssi_ros.updating.error_place import ErrorPlace, Problem, Recording

LEAST_ROWS = 40         # of a segment
CAP, LEVEL_CAP = 2.0, 1.5           # longest step: deviations of an error, log of a level
# segments before the full ones are so many times shorter; the better end of both counts
SCHEDULES = (60, 20, 7, 2.5), (40, 15, 5, 2)
FULL = 2                # stages of full segments, what modes correlate taken anew for each
STAGE_STEPS, LAST_STEPS = 12, 20
LEAST_KNOWN = 1e-6      # of the information of a number, in its scale


@dataclass(frozen=True, eq=False)
class ErrorFit:
    """Errors of a model at their most probable values, and the effect that was fitted beside."""

    names: tuple            # (m,)
    values: np.ndarray      # (m,), in the units of Calibration, of the first recording
    stds: np.ndarray        # (m,), declared
    information: np.ndarray  # (n, n), of the recordings alone, in deviations, all else profiled
    levels: tuple           # of every recording
    log_likelihood: float   # with the prior
    covariance: np.ndarray  # (m, m), what remains unknown of the values
    candidate: Candidate    # at its most probable numbers
    of_candidate: np.ndarray    # (q, q), covariance of its coordinates, errors projected out
    correlation: object     # Correlation of the first recording
    others: object = ()     # errors that each later recording has on its own, (r - 1, f)

    @property
    def occam(self):
        """Return the log of posterior over prior volume of the errors."""
        return -np.linalg.slogdet(self.information + np.eye(len(self.information)))[1] / 2

    def of(self, number):
        """Return the fit as that of one of its recordings alone begins."""
        values = self.values.copy()
        if number:
            values[of_recording(self.names)] = self.others[number - 1]
        return replace(self, values=values, levels=(self.levels[number],),
                       others=())

    @property
    def log_evidence(self):
        """Return the log evidence of the model with errors of its own, and the effect beside."""
        return self.log_likelihood + self.occam + log_prior_ratio(
            priors_of(self.candidate), self.of_candidate)


def fit_errors(spacecraft, samples, names, stds, settings, *, present=(), before=None,
               candidate=Candidate(), steps=None, recorded=(None,), progress=lambda share: None):
    """
    Fit the errors of a model to recordings.

    Parameters
    ----------
    spacecraft : Spacecraft
        The model.
    samples : sequence of Samples
        Recordings without gaps, with the channels of the model.
    names, stds
        Errors and their declared deviations, of `declared`.
    settings : DiagnosisSettings
        Segments and band.
    present : tuple of Effect
        Effects that the model has.
    before : ErrorFit, optional
        Where to begin; then only the last stage is made.
    candidate : Candidate
        Effects whose numbers are fitted beside.
    steps : int, optional
        Of the last stage at most.
    recorded : sequence of RecordedInputs or None
        Inputs that come before the channels of each of the samples; one alone serves all.
    progress : callable
        Called with the share done.

    Returns
    -------
    ErrorFit

    """
    spacecraft = replace(spacecraft, calibration=Calibration(names, np.zeros(len(names))))
    errors, every = errors_of(names, len(samples)), np.append(
        stds, np.tile(stds[of_recording(names)], len(samples) - 1))
    start, schedules = (None, np.zeros(len(every)), candidate), [[settings.segment_s]]
    if before is None:
        least_s = max(LEAST_ROWS / samples[0].rate_hz, 1.0)
        schedules = [[settings.segment_s / k for k in shares if settings.segment_s / k > least_s]
                     + FULL * [settings.segment_s] for shares in SCHEDULES]
    else:
        start = (np.log(np.ravel(before.levels)),
                 np.append(before.values, np.ravel(before.others)), candidate)
    own = recorded if len(recorded) > 1 else repeat(*recorded)
    ends, done, total = [], 0, sum(map(len, schedules))
    for schedule in schedules:
        at = start
        for number, segment_s in enumerate(schedule):
            recordings = [_recording(spacecraft, s, settings, segment_s, (present, inputs))
                          for s, inputs in zip(samples, own)]
            last = number == len(schedule) - 1
            if segment_s == settings.segment_s and at[0] is not None:
                logs = np.reshape(at[0], (len(recordings), -1))
                recordings = [r.correlated(g, at[1][e], at[2])
                              for r, g, e in zip(recordings, logs, errors)]
            here = climbed(Problem(recordings, every, at[2], errors), *at[:2],
                           (steps or LAST_STEPS) if last else STAGE_STEPS)
            if here is not None:            # else the next stage tries from the same place
                at = here.logs.ravel(), here.unit * every, here.candidate
            done += 1
            progress(done / total)
        ends += [here] if here is not None else []
    if not ends:
        raise ValueError('the errors of the model could not be fitted to the recording: its '
                         'spectrum is not finite')
    best = max(ends, key=lambda here: here.value)
    of_errors, unknown, of_candidate = _profiled(best, scales_of(candidate))
    values, first = best.unit * every, errors[0]
    return ErrorFit(names, values[first], stds, of_errors, tuple(np.exp(best.logs)), best.value,
                    stds[:, None] * unknown[np.ix_(first, first)] * stds, best.candidate,
                    of_candidate, best.problem.recordings[0].correlation,
                    values[len(names):].reshape(len(samples) - 1, of_recording(names).sum()))


def errors_of(names, count):
    """Return where the errors (m,) of each of `count` recordings are among those of all."""
    own, m = of_recording(names), len(names)
    found = [np.arange(m)]
    for number in range(count - 1):
        at = np.arange(m)
        at[own] = m + own.sum() * number + np.arange(own.sum())
        found.append(at)
    return tuple(found)


def climbed(problem, levels, values, steps):
    """
    Climb to the most probable errors, levels and numbers of a candidate.

    Parameters
    ----------
    problem : Problem
        Recordings of one spacecraft, and where the numbers of the candidate begin.
    levels : ndarray or None
        Logarithms of the levels of all recordings to begin at, 0 if None.
    values : ndarray, (n,)
        Errors to begin at, in the units of `Calibration`.
    steps : int
        At most.

    Returns
    -------
    ErrorPlace or None
        With `value`, the log likelihood with all priors, and `unit`, the errors in deviations.

    """
    candidate, stds = problem.candidate, problem.stds
    there = problem.recordings[0].simulator.expected_there(candidate)
    count = len(there.names) * len(problem.recordings)
    if levels is None or len(levels) != count:
        levels = np.zeros(count)
    begin = ErrorPlace(problem, np.concatenate([levels, values / stds, candidate.point()]))
    caps = np.concatenate([np.full(count, LEVEL_CAP), np.full(len(stds), CAP),
                           LEVEL_CAP * scales_of(candidate)])
    return maximise(begin, caps, steps)[0] if np.isfinite(begin.value) else None


def _profiled(here, scales):
    """Return the information of the errors, and covariances of them and of the coordinates."""
    information = here.fisher()
    levels, m = here.logs.size, len(here.unit)
    prior = np.concatenate([np.tile(here.prior, len(here.logs)), np.zeros(m),
                            LEAST_KNOWN / np.square(scales)])
    information += np.diag(prior)
    at = np.arange(len(information))
    errors, numbers = (at >= levels) & (at < levels + m), at >= levels + m

    mixed = information[np.ix_(errors, ~errors)]
    of_errors = information[np.ix_(errors, errors)] - mixed @ np.linalg.solve(
        information[np.ix_(~errors, ~errors)], mixed.T)
    information[errors, errors] += 1.0
    whole = covariance(information, np.append(np.ones(levels + m), scales))
    return of_errors, whole[np.ix_(errors, errors)], whole[np.ix_(numbers, numbers)]


def _recording(spacecraft, samples, settings, segment_s, beside):
    """Cut a recording into segments of a length; beside are present effects, and inputs."""
    present, recorded = beside
    frame = frame_of(samples, replace(settings, segment_s=segment_s, band_bins=1))
    simulator = Simulator(spacecraft, frame, samples.duration_s, present, recorded=recorded,
                          late=samples.staggered)
    return Recording(simulator, simulator.evidence(samples))
