"""Records whose short gaps and clipped values are filled by a model that has moved."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.spectra.imputation import completed
from ssi_ros.updating.adapt import adapt

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
