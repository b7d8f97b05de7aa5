"""Records whose short gaps and clipped values are filled by a model that has moved."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.spectra.imputation import completed, filled
from ssi_ros.gap.spectra.thresholds import LIMITS as SPECTRA
from ssi_ros.updating.adapt import adapt
from ssi_ros.updating.settled import explains, search_of
from ssi_ros.updating.systematic_errors import filled_share

LEAST_NATS = 2.0        # that an effect gains in the share of a record that is filled
REFILLS = 8             # of the gaps of a record by a model that is moved, at most,
SETTLED = 0.05          # until no error moves by so many of its deviations


def of_clipped(record, simulator, levels, settings):
    """Return a record, its clipped values, that is all large motion, drawn by a moved model."""
    clipped = record.raw and not np.isnan(record.raw[1]).all()
    return refilled(record, simulator, levels, settings) if clipped else record


def refilled(record, simulator, levels, settings):
    """
    Return a record whose short gaps another model has filled.

    Parameters
    ----------
    record : Record
        As made ready, with what it was before its gaps were filled.
    simulator : Simulator
        The model.
    levels : ndarray
        Of its excitation and noise, from which those of the filled samples are found.
    settings : DiagnosisSettings
        Of the diagnosis.

    Returns
    -------
    Record

    """
    if not record.raw:
        return record
    # what was filled by a model that is wrong is no motion of this structure
    _, samples, spectra, _ = completed(simulator, *record.raw, settings, levels)
    return replace(record, samples=samples, spectra=spectra)


def as_the_best_has_it(comparison):
    """
    Return the Record of a ModelComparison, its gaps filled as the best single effect has them.

    What is filled without an effect is the less like it the larger it is: a hub that turns to
    and fro jumps at both ends of every gap. None where nothing was filled, or little is gained.
    """
    record, null = comparison.record, comparison.null
    if record.unfilled is record.samples or explains(comparison):
        return None
    best = next((r.fit for r in search_of(comparison).singles()), null)
    if (best.log_likelihood - null.log_likelihood) * filled_share(record) < LEAST_NATS:
        return None
    simulator = comparison.side(best).simulator
    samples = filled(simulator, record.unfilled, best.levels, best.candidate,
                     longest_s=SPECTRA.filled_s.value)
    return replace(record, samples=samples, spectra=simulator.evidence(samples))


def adapted_and_filled(simulator, record, settings, progress):
    """Return the model moved onto a record, and the record, its gaps filled by the moved model."""
    adapted = adapt(simulator, record.samples, settings, progress)
    for _ in range(REFILLS if record.raw else 0):
        record, before = refilled(record, adapted.simulator.but(
            compensation=None), adapted.fit.levels[0], settings), adapted.fit.values
        adapted = adapt(simulator, record.samples, settings, before=adapted)
        if np.abs((adapted.fit.values - before) / adapted.fit.stds).max() < SETTLED:
            break
    return adapted, record
