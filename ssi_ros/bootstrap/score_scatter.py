"""
The scatter of scores where segments or frequencies are correlated, eq. (105f).

What a lightly damped mode does in a segment rings on into the next ones. Where many segments of a
record lie within one decay, as those of a short record or between gaps, scores scatter by up to
two and a half times what independent segments say. So they do where channels that outnumber the
inputs follow each other down to little noise: what they do not share is then no noise but the
motion at both ends of a segment, which neighbouring frequencies have in common. Records of the
model, cut alike, show by how much.
"""
from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len

from ssi_ros.gap.inference.goodness_of_fit import measure
from ssi_ros.gap.inference.score_test import directions, score
from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.inference.unmodelled.scores import change_directions, score_changes
from ssi_ros.gap.spectra.imputation import spectrum
from ssi_ros.hermitian import inverse_root
from ssi_ros.integrity.filling import record_of
from ssi_ros.records import Samples

RECORDS = 48
TAIL = 3.0              # standard deviations at which distances of bands are compared
SEED = 9_200_000        # far from seeds that records are made with


@dataclass(frozen=True, eq=False)
class Scatter:
    """Standard deviations over those of independent segments, at least 1."""

    scores: np.ndarray = 1.0    # (t,), of effects
    changes: np.ndarray = 1.0   # (s,), of unmodelled changes
    gap: float = 1.0            # of the gap statistic
    bands: np.ndarray = 1.0     # (b,), largest distance of every band over that of theory


def scatter_of(simulator, fitted, evidence, tests):
    """Return the Scatter of BootstrapTests around a Fit; 1 each where segments are long."""
    frame, settings, uncertainty = evidence.frame, tests.settings, tests.uncertainty
    if frame.span_s >= LIMITS.short_segment.value * settings.segment_s and not (
            leaks(simulator, fitted)):
        return Scatter()
    rows, draws = frame.begins[-1] + frame.rows, np.random.default_rng(SEED)
    period = 2 * next_fast_len(rows, real=True)
    root = np.linalg.cholesky(spectrum(simulator, period, fitted.levels, fitted.candidate))
    here = directions(tests.templates, fitted, evidence, uncertainty)
    of_changes = change_directions(tests.changes, fitted, evidence, uncertainty)
    found, bands = [], []
    for _ in range(RECORDS):
        values = record_of(root, draws)[:rows]
        samples = Samples(values - values.mean(axis=0), frame.rate_hz, ('',) * values.shape[1])
        record = simulator.evidence(samples)
        gap = measure(fitted.model, record, settings.band_bins)
        bands.append(gap.bands)
        found.append((
            score(tests.templates, fitted, record, uncertainty, here, False).z,
            score_changes(tests.changes, fitted, record, uncertainty, of_changes).z,
            gap.deviations))
    top = np.mean(bands, axis=0) + TAIL * np.std(bands, axis=0)
    usual = TAIL * gap.floor_std * np.sqrt(len(gap.bands))
    return Scatter(*(np.maximum(1.0, np.std(np.array(column), axis=0, ddof=1))
                     for column in zip(*found)),
                   np.maximum(1.0, (gap.floor + top) / (gap.floor + usual)))


def leaks(simulator, fitted):
    """Return whether much of what channels do not share is from the ends of segments."""
    frame, expected = simulator.frame, fitted.plain.mean(axis=0)
    if simulator.recorded or _inputs(simulator, fitted) >= expected.shape[-1]:
        return False
    there = spectrum(simulator, 2 * frame.rows, fitted.levels, fitted.candidate)
    lower = inverse_root(expected)
    own = lower @ there[2 * frame.first:2 * frame.last:2] @ lower.conj().swapaxes(-1, -2)
    return bool(1 - np.linalg.eigvalsh(own)[:, 0].mean() > LIMITS.leakage.value)


def _inputs(simulator, fitted):
    """Return how many random inputs a model has."""
    system = simulator.setup(fitted.candidate, fitted.levels).system
    random = [p for p in system.excitation if hasattr(p, 'covariance')]
    return len({i for p in random for i in np.flatnonzero(
        np.diag(p.covariance(system.rate_hz, system.inputs)))})
