"""A model that may be wrong, moved onto a record and onto what its recorded inputs make of it."""
from dataclasses import replace

import numpy as np

from ssi_ros.inputs.beside import anchored, observed
from ssi_ros.model.errors import Calibration
from ssi_ros.records import Samples
from ssi_ros.updating.adapt import adapt


def adapted_beside(spacecraft, simulator, record, settings, progress=lambda share: None):
    """
    Move a model onto a record beside its inputs, and predict with what that gives.

    The channels alone say where the modes are, the inputs then the rest: a prediction by a model
    that is many line widths off says little.

    Parameters
    ----------
    spacecraft : Spacecraft
        The model, with the levels of all its inputs.
    simulator : Simulator
        Of the model without what was recorded, beside the inputs.
    record : Record
        The record beside the inputs, without gaps.
    settings : DiagnosisSettings
        Segments and band.
    progress : callable
        Called with the share done.

    Returns
    -------
    Adapted, Record

    """
    recorded, known, samples = simulator.recorded, simulator.known, record.samples
    channels = Samples(samples.values[:, known:] + recorded.taken, samples.rate_hz,
                       samples.channels[known:], samples.start_ns)
    alone = simulator.but(spacecraft=spacecraft, recorded=None)
    found = adapt(alone, channels, settings, lambda share: progress(share / 2))
    bare = simulator
    for last in (False, True):
        at = replace(bare.spacecraft, calibration=Calibration(found.fit.names, found.fit.values))
        simulator, samples = _predicted_by(bare, at, channels)
        if not last:
            found = adapt(simulator, samples, settings,
                          lambda share: progress(0.5 + share / 2), before=found)
    found = replace(found, simulator=found.simulator.but(recorded=simulator.recorded))
    return found, replace(record, samples=samples, spectra=simulator.evidence(samples))


def _predicted_by(simulator, spacecraft, channels):
    """Return a model side and channels beside inputs that are predicted by a spacecraft."""
    recorded = anchored(simulator.but(spacecraft=spacecraft), simulator.recorded)
    return observed(simulator, recorded, channels, np.full(channels.values.shape, np.nan))[:2]
