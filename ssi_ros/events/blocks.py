"""
Tests in time of a long record, block by block.

What is searched coherently over a whole record, as lines, sweeps and impulses, would cost memory
and time that grow faster than its length. Beyond half an hour blocks of equal length are searched
each by itself; the least p-value of n blocks counts as 1 - (1 - p)^n, so that a line must be
stronger than a search of the whole record would need, by about the root of n in amplitude.
"""
from dataclasses import replace
import math

import numpy as np

from ssi_ros.effects import effect_class
from ssi_ros.events.joint_forces import joint_forces
from ssi_ros.gap.detectors import (
    ANOMALIES, anomalies, detect_in_input, detect_in_spectrum, open_set)
from ssi_ros.gap.detectors.input_reconstruction import reconstruct
from ssi_ros.gap.detectors.thresholds import LIMITS

LONGEST_S = 1800.0      # of a block
LEAST = 0.5             # share of a block that is recorded


def blocks(samples, missing=None):
    """
    Yield begin [s], Samples and missing rows of every block; the record itself if it is short.

    Parameters
    ----------
    samples : Samples
        Without gaps.
    missing : ndarray of bool, shape (n,), optional
        Rows that were filled; blocks that have hardly others are left out.

    """
    rows = len(samples.values)
    missing = np.zeros(rows, bool) if missing is None else missing
    count = max(1, math.ceil(rows / samples.rate_hz / LONGEST_S - 1e-9))
    size = math.ceil(rows / count)
    for begin in np.linspace(0, rows - size, count).round().astype(int):
        part = slice(begin, begin + size)
        if count == 1 or np.mean(~missing[part]) > LEAST:
            yield (begin / samples.rate_hz, replace(samples, values=samples.values[part]),
                   missing[part])


def search(simulator, fitted, samples, settings, names, missing=None, asked=ANOMALIES,
           also=None, filters=None):
    """
    Search all blocks of a record for effects by name, and for what no effect makes.

    Parameters
    ----------
    simulator, fitted, samples, settings
        As of `reconstruct`.
    names : tuple of str
        Effects.
    missing : ndarray of bool, shape (n,), optional
        Rows that were filled.
    asked : sequence of str
        Bases of the anomalies that are searched.
    also : callable, optional
        Called with every Reconstruction.
    filters : dict, optional
        Of `reconstruct`, of a fit near by: kept, and used where they are there already.

    Returns
    -------
    tuple of Detection, tuple of Detection
        Of effects, and of no effect.

    """
    found, others, filters = [], [], {} if filters is None else filters
    for at_s, part, gone in blocks(samples, missing):
        inputs = reconstruct(simulator, fitted, part, settings, gone, filters)
        found.append((at_s, detect_in_input(inputs, names) + detect_in_spectrum(
            simulator, fitted, part, settings, names)))
        others.append((at_s, anomalies(inputs, part.channels, asked) + open_set(
            simulator, fitted, inputs, part.channels, asked) + joint_forces(
            simulator, fitted, inputs, part.channels, asked)))
        if also is not None:
            also(inputs)
        span_s = len(part.values) / part.rate_hz
    duration_s = len(samples.values) / samples.rate_hz
    return tuple(d for d in _joined(found, span_s, duration_s)
                 if len(found) == 1 or d.p_value <= LIMITS.p_value.value), _joined(
        others, span_s, duration_s)


def explained_below_band(whole, names, settings, detections):
    """
    Return the log odds of detections below the fitted band that are gone with a fit.

    No likelihood of a fit has counted those frequencies; a nutation there is like slow noise. The
    detections are of the model without effects, `names` of the effects of the fit; `whole()`
    returns model side, fit and samples without gaps, as of `search`.
    """
    before = {d.effect: d.log_odds for d in detections if d.effect
              and effect_class(d.effect).below_band and d.effect not in names}
    if not before:
        return 0.0
    simulator, fitted, samples = whole()
    after = {d.effect: d.log_odds for d in _in_spectrum(
        simulator, fitted, samples, settings, tuple(before))}
    return sum(max(odds - after.get(name, 0.0), 0.0) for name, odds in before.items())


def _in_spectrum(simulator, fitted, samples, settings, names):
    """Return the detections of effects in the spectra of all blocks."""
    found = [(at_s, detect_in_spectrum(simulator, fitted, part, settings, names))
             for at_s, part, _ in blocks(samples)]
    return _joined(found, min(LONGEST_S, samples.duration_s), samples.duration_s)


def _joined(found, span_s, duration_s):
    """Return the best detection of every kind, of n blocks: pairs of begin [s] and detections."""
    if len(found) < 2:
        return found[0][1] if found else ()
    kinds = {}
    for at_s, detections in found:
        for d in detections:
            key = d.effect or (d.basis, d.parameters.get('channel'))
            kinds.setdefault(key, []).append((at_s, d))
    return tuple(_best_of(each, len(found), span_s, duration_s) for each in kinds.values())


def _best_of(each, count, span_s, duration_s):
    at_s, best = min(each, key=lambda pair: pair[1].p_value)
    p_value = float(-np.expm1(count * np.log1p(-min(best.p_value, 1 - 1e-16))))
    basis, parameters = best.basis, best.parameters
    if best.effect:
        basis = basis.in_record(at_s, span_s, duration_s)
        parameters = basis.values()
    timed = [(at, d.times) for at, d in each if len(d.times)]
    times = tuple(np.concatenate(c) for c in zip(*((at + t, p) for at, (t, p) in timed)))
    return replace(best, p_value=p_value, trials=best.trials * count, basis=basis, times=times,
                   parameters=parameters, text=f'{best.text[:-1]} (from {at_s:.0f} to '
                   f'{at_s + span_s:.0f} s).')
