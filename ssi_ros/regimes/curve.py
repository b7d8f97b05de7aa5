"""Whether a channel of two recordings follows another curve, of which no linear effect is."""
import numpy as np

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.base import Site
from ssi_ros.effects.registry import modal_forms
from ssi_ros.events.prediction_error import slow
from ssi_ros.gap.comparison import Detection
from ssi_ros.open_set.curve_beside import curve_beside, Motion
from ssi_ros.regimes.regime import Regime


def is_linear(names):
    """Return whether effects leave Gaussian motion Gaussian: filters of channels and of inputs."""
    # a structure may be as nonlinear at its new place as it is, which is no curve of a channel
    return all(n in modal_forms() and effect_class(n).site is not Site.STRUCTURE
               and ModalPattern.SAMPLE_VALUES not in effect_class(n).patterns for n in names)


def curve_of(recordings):
    """Return what a `Recordings` shows of a curve as one Detection of no effect, else nothing."""
    if recordings.repeats is not None or recordings.regime != Regime():
        return ()       # motion that is not random has no theory here
    of = [Motion(v - v.mean(axis=0), _level(e, len(v)), recordings.pair.rate_hz,
                 s.cut.middles_hz, s.mean)
          for v, e, s in zip((recordings.pair.reference, recordings.pair.record),
                             recordings.prediction_errors, (recordings.one, recordings.two))]
    found = curve_beside(*of, recordings.pair.channels)
    return (Detection('', {}, found.p_value, found.text, basis=found.family),)


def _level(errors, rows):
    """Return the slow level of inputs at every row, (n,): the rms of what comes new, over its."""
    power = np.mean(errors ** 2, axis=1)
    return np.sqrt(np.pad(slow(power) / power.mean(), (rows - len(power), 0), mode='edge'))
