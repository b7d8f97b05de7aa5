"""Whether a channel does what no linear effect that is steady makes of it."""
import numpy as np

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.base import Site
from ssi_ros.effects.places import offered
from ssi_ros.effects.registry import modal_forms
from ssi_ros.events.contacts import makes_contact
from ssi_ros.events.joint_forces import has_joints, is_linear_and_steady, is_linear_side
from ssi_ros.events.prediction_error import predictor
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.open_set.curve_beside import curve_beside, Motion, product_beside
from ssi_ros.open_set.force_beside import Driven, FAMILY as FORCE, force_beside
from ssi_ros.open_set.force_between import FAMILIES as FORCES
from ssi_ros.open_set.gain_beside import gain_beside, GainScores
from ssi_ros.past_motion import level_of_inputs
from ssi_ros.regimes.regime import Regime
from ssi_ros.windows import slow

FAULTY = 1e-3           # p-value of a channel that follows a curve, or of events
MOST_S = 1800.0         # of a record that is asked
SLOWEST = 10.0          # cycles of the slowest motion in a record
INTEGRALS = 0, 1, 2     # of an acceleration, whose strengths a nonlinear force may follow


def is_linear(names):
    """Return whether effects leave Gaussian motion Gaussian: filters of channels and of inputs."""
    # a structure may be as nonlinear at its new place as it is, which is no curve of a channel
    return keeps_channels(names) and all(
        effect_class(n).site is not Site.STRUCTURE for n in names)


def keeps_channels(names):
    """Return whether all channels are straight lines of the motion beside effects: no events."""
    return all(n in modal_forms()
               and ModalPattern.SAMPLE_VALUES not in effect_class(n).patterns for n in names)


def is_steady(names):
    """Return whether effects leave a linear structure linear: its modes may be elsewhere."""
    return keeps_channels(names) and not any(effect_class(n).nonlinear for n in names)


def odd_channels(recordings):
    """Return what `Recordings` show of curves, products, gains and forces, of no effect."""
    if recordings.repeats is not None or recordings.regime != Regime():
        return ()       # motion that is not random has no theory here
    predicted = [(*both, e) for both, e in zip(recordings.predictors,
                                               recordings.prediction_errors)]
    found = findings_beside(predicted, recordings.pair.rate_hz,
                            recordings.full_cut.middles_hz[0], recordings.pair.channels)
    return _detections(found)


def _detections(found):
    """Return the Detections of Findings, the p-value of each that of all of them."""
    return tuple(Detection(
        '', {'channel': f.channel}, min(1.0, len(found) * f.p_value), f.text, basis=f.family,
        site=(Site.SENSOR if f.channel else Site.STRUCTURE).value) for f in found)


def left_beside(recordings, names, deviations):
    """
    Return the Detections of no effect that some effects leave, beside a recording.

    Parameters
    ----------
    recordings : Recordings
        The reference and the record.
    names : sequence of str
        Of the effects; none for the reference as it is.
    deviations : float
        Of the gap without effects, in standard deviations of its floor.

    Returns
    -------
    tuple of Detection

    """
    found, sure = recordings.odd_channels, () if makes_contact(names) else recordings.contact
    seen = {d.effect for d in recordings.detections[0] if not d.weak}
    if not keeps_channels(seen):    # events ring, and motion that is not Gaussian has curves
        found = tuple(d for d in found if d.basis != FORCE)
    if names and is_linear(names):
        return found + sure
    # a structure may be as nonlinear as it was, at another level or where it is now
    if names and is_steady(names):
        sure += tuple(d for d in found if d.basis == FORCE)
    if recordings.clear_level or not keeps_channels(seen.intersection(names)) or (
            names and deviations > LIMITS.inside.value):
        return sure
    return sure + tuple(d for d in found
                        if d not in sure and d.p_value < LIMITS.certain_shift.value)


def beside_model(comparison):
    """
    Return what a record shows of curves, products, gains and forces that no linear model makes.

    Parameters
    ----------
    comparison : ModelComparison
        Of a record, whose first half hour is asked, with a model whose healthy recordings hold
        nothing of that kind, without recorded inputs; there is no Detection otherwise.

    Returns
    -------
    tuple of Detection

    """
    # the open-set test of a spacecraft asks the same of its modes
    simulator, samples = comparison.simulator, comparison.record.samples
    model = simulator.spacecraft
    if 'geometry' in offered(model) or not is_linear_side(simulator):
        return ()
    values = samples.values[:int(MOST_S * samples.rate_hz)]
    values = values - values.mean(axis=0)
    if not np.all(values.std(axis=0) > 0.0):
        return ()
    way = predictor(values)
    return _detections(findings_beside(
        (None, (values, way, way.residual(values))), samples.rate_hz,
        SLOWEST * samples.rate_hz / len(values), samples.channels, not has_joints(model)))


def left_beside_model(odd, channels, names, seen):
    """
    Return the Detections of no effect that effects leave, beside what was detected of others.

    Parameters
    ----------
    odd, channels : tuple of Detection
        Of a fit, and of the channels alone.
    names : tuple of str
        Of the effects of the fit.
    seen : tuple of Detection
        Of effects.

    """
    # events ring, and motion that is not Gaussian has curves
    if not all(is_linear_and_steady(d.effect) for d in seen if d.p_value < FAULTY):
        return tuple(d for d in odd if d.basis not in FORCES)
    # what one channel makes of its values is in all that follows it, and no force
    forces = [d for d in odd if d.basis in FORCES]
    if min((d.p_value for d in channels), default=1.0) < min(
            (d.p_value for d in forces), default=0.0):
        odd = tuple(d for d in odd if d not in forces)
    return odd + (channels if all(map(is_linear_and_steady, names)) else ())


def findings_beside(predicted, rate_hz, lowest_hz, channels, forces=True):
    """
    Return the Findings of a curve, product, gain and force that a record has, a reference not.

    Parameters
    ----------
    predicted : sequence of two (ndarray (n, l), Predictor, ndarray (n - k, l))
        Values of the reference and of the record, the linear prediction of each, and its errors;
        None in place of the reference beside a model that is linear.
    rate_hz, lowest_hz : float
        Of the samples, and of the motion that they hold.
    channels : sequence of str
        Names of the l channels.
    forces : bool
        Whether forces are asked for: they are not where a model has points to put them.

    """
    motions, gains, driven = zip(*(_as_tested(p, rate_hz, lowest_hz) for p in predicted))
    found = (curve_beside(*motions, channels), product_beside(*motions, channels),
             gain_beside(*gains, channels))
    if not forces:
        return found
    # what a channel alone makes of its values is in what follows it, and no force
    wrong = {f.channel for f in found if f.p_value < FAULTY} - {''}
    return *found, force_beside(*driven, channels, wrong)


def _as_tested(predicted, rate_hz, lowest_hz):
    """Return what the tests of curves, of gains and of forces need of one recording."""
    if predicted is None:
        return None, None, None
    values, way, errors = predicted
    scaled = (values - values.mean(axis=0)) / way.scale
    # without the first rows, which have no past
    strength = _strength(scaled, lowest_hz / rate_hz)[-len(errors):]
    return (Motion(scaled, way.adjoint(errors), _level(errors, len(values)), rate_hz),
            GainScores(way.gain_scores(values, errors), strength, len(values) / rate_hz),
            Driven(scaled * way.scale, errors, rate_hz, lowest_hz))


def _level(errors, rows):
    """Return the slow level of inputs at every row, (n,): the rms of what comes new, over its."""
    level = level_of_inputs(errors) / np.sqrt(np.mean(errors ** 2))
    return np.pad(level, (rows - len(level), 0), mode='edge')


def _strength(values, low):
    """Return slow powers of channels and of their integrals, (n, l, s), over their means."""
    cycles, spectrum = np.fft.rfftfreq(len(values)), np.fft.rfft(values, axis=0)
    found = []
    for k in INTEGRALS:
        # below the lowest band there is noise alone, which integrals raise
        over = np.where(cycles < low, 0.0, np.maximum(cycles, low) ** -float(k))
        power = np.fft.irfft(spectrum * over[:, None], len(values), axis=0) ** 2
        found.append(np.array([slow(p) / (p.mean() or 1.0) for p in power.T]).T)
    return np.stack(found, axis=-1)
