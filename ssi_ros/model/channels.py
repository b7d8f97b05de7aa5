"""A model with fewer channels than it has: of what was not recorded nothing can be said."""
from dataclasses import replace

import numpy as np

from ssi_ros.model.errors import ALONG, GAIN, LATERAL, SHAPE

OF_SENSORS = SHAPE, GAIN, ALONG, LATERAL


def with_channels(model, names):
    """
    Return a model that has some of its channels alone.

    Parameters
    ----------
    model : Spacecraft or LinearModel
        With a calibration or without.
    names : sequence of str
        Of the sensors that stay, in the order of the model.

    Returns
    -------
    Spacecraft or LinearModel
        The same one, where all stay.

    """
    kept = [i for i, s in enumerate(model.sensors) if s.name in names]
    if len(kept) == len(model.sensors):
        return model
    sensors = tuple(model.sensors[i] for i in kept)
    gone = {s.name for s in model.sensors} - {s.name for s in sensors}
    known = _without(model.calibration, gone)
    if not hasattr(model, 'output'):
        return replace(model, sensors=sensors, calibration=known)
    rest = model.quadrature
    if rest is not None:
        rest = replace(rest, shapes=rest.shapes[kept], rest=replace(
            rest.rest, c=rest.rest.c[kept], d=rest.rest.d[kept]))
    unsure = model.uncertainty
    if not unsure.exact:
        unsure = unsure.of_channels(kept)
    return replace(model, sensors=sensors, output=model.output[kept], quadrature=rest,
                   uncertainty=unsure, calibration=known)


def of_channels(effects, channels):
    """
    Return the effects that are of some channels, or of all of them.

    Parameters
    ----------
    effects : sequence of Effect
        Of a model that may have more channels.
    channels : sequence of str
        Names of those that stay.

    Returns
    -------
    tuple of Effect

    """
    some = {'all', *channels}
    return tuple(e for e in effects
                 if {getattr(e, word, 'all') for word in ('channel', 'source')} <= some)


def _without(calibration, gone):
    """Return a calibration without the errors of sensors: the others keep their own."""
    kept = [i for i, name in enumerate(calibration.names) if not (
        name.split()[0] in OF_SENSORS and name.split()[-1] in gone)]
    covariance = np.reshape(calibration.covariance, (len(calibration.names),) * 2)[
        np.ix_(kept, kept)] if calibration.covariance else ()
    return replace(calibration, names=tuple(calibration.names[i] for i in kept),
                   values=[calibration.values[i] for i in kept], covariance=covariance)
