"""A record set beside what its recorded inputs make of a model."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import effect_class, inject
from ssi_ros.effects.base import Site
from ssi_ros.effects.simulate import simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.whittle import Evidence
from ssi_ros.gap.spectra.imputation import filled, without_clipped
from ssi_ros.inputs.prediction import played, response, ringing
from ssi_ros.inputs.recorded import RecordedInputs
from ssi_ros.inputs.thresholds import LIMITS
from ssi_ros.integrity.fault import Fault
from ssi_ros.model import assemble
from ssi_ros.model.excitation import begin_all
from ssi_ros.records import Samples
from ssi_ros.windows import tapered_dft

SEED = 1                # of inputs that are still to be recorded
NEGLIGIBLE = 1e-9       # level of an input of a LinearModel, which needs one above zero


def unrecorded(model, names):
    """Return a model whose excitation is what was not recorded."""
    if hasattr(model, 'drives'):
        others = any(d.level > 0.0 for d in model.drives if d.name not in names)
        return replace(model, drives=tuple(
            replace(d, level=0.0 if others else NEGLIGIBLE * (d.level or 1.0), group='')
            if d.name in names else d for d in model.drives))
    excitation = model.excitation
    return replace(model, excitation=replace(excitation, torque_rms_n_m=tuple(
        0.0 if n in names else rms
        for n, rms in zip(inputs_of(model), excitation.torque_rms_n_m))))


def inputs_of(model):
    """Return the names of the inputs of a model that may be recorded."""
    if hasattr(model, 'drives'):
        return tuple(d.name for d in model.drives)
    return tuple(f'torque_{axis}' for axis in 'xyz')


def driven_inputs(model):
    """Return the names of the inputs of a model that have a level."""
    if hasattr(model, 'drives'):
        return tuple(d.name for d in model.drives if d.level > 0.0)
    return tuple(n for n, rms in zip(inputs_of(model), model.excitation.torque_rms_n_m) if rms)


def acting(effects, simulator):
    """Return those of some effects that act at all, where no random excitation may be left."""
    model = simulator.spacecraft
    if simulator.recorded is None:
        return tuple(effects)
    setup = inject(model)
    if any(p.covariance(model.rate_hz, setup.system.inputs).max() > NEGLIGIBLE ** 1.5
           for p in setup.system.excitation) or not hasattr(model, 'drives'):
        return tuple(effects)
    bare = replace(setup, system=replace(setup.system, excitation=()))

    def acts(cls):
        at = {k: v[0] for k, v in cls.starts.items()}
        return cls.site is not Site.EXCITATION or bool(cls(**at).apply(bare).system.excitation)
    return tuple(n for n in effects if acts(effect_class(n)))


def beside_inputs(simulator, samples, limits, inputs):
    """
    Set a record beside its recorded inputs.

    Parameters
    ----------
    simulator : Simulator
        Of the model, with the levels of all its inputs.
    samples : Samples
        The channels, NaN where one is missing.
    limits : ndarray, shape (n, l)
        Clipped values, NaN elsewhere.
    inputs : Samples
        The inputs, named as those of the model, in the same rows.

    Returns
    -------
    Simulator
        Which has the inputs before its channels, and excites by what was not recorded.
    Samples
        The inputs, and the channels less what the model makes of them.
    ndarray, shape (n, m + l)
        Clipped values less the same.

    Raises
    ------
    ValueError
        If the inputs do not fit the record, or too much of them is missing.

    """
    _check(samples, inputs)
    simulator = simulator.but(spacecraft=unrecorded(simulator.spacecraft, inputs.channels))
    recorded = RecordedInputs(inputs.channels, _whole(simulator, samples, inputs),
                              samples.rate_hz)
    return observed(simulator, anchored(simulator, recorded), samples, limits)


def anchored(simulator, recorded):
    """Return the inputs with the response of a model side, before any effect, as prediction."""
    plain = tuple(e for e in simulator.present if not e.nonlinear and e.spectral)
    anchor = inject(simulator.spacecraft, plain, simulator.duration_s)
    anchor = replace(anchor, drift=0.0, delays_s=(), corners_hz=(), jitter_rms_s=0.0)
    return replace(recorded, anchor=anchor, base=response(anchor, recorded), known={})


def to_be_recorded(simulator, names, rows):
    """
    Set a model side beside inputs of a record that is still to be made.

    Parameters
    ----------
    simulator : Simulator
        Of the model, with the levels of all its inputs.
    names : sequence of str
        Inputs that will be recorded; they do what the model says of them.
    rows : int
        Of the record.

    Returns
    -------
    Simulator

    Raises
    ------
    ValueError
        If the model has no such input, or gives it no level.

    """
    model, driven = simulator.spacecraft, driven_inputs(simulator.spacecraft)
    for name in names:
        if name not in driven:
            raise ValueError(
                f'the input {name} has no level in the model, so that nothing can be said of it '
                f'before the record is made; give it one, or name one of {", ".join(driven)}'
                if name in inputs_of(model) else
                f'the model has no input {name!r}; it has {", ".join(inputs_of(model))}')
    system = assemble(model)
    forces = begin_all(system.excitation, system.rate_hz, system.inputs, SEED)(0, rows)
    values = forces[:, [system.inputs.index(n) for n in names]]
    side = simulator.but(spacecraft=unrecorded(model, names))
    recorded = RecordedInputs(tuple(names), values - values.mean(axis=0), system.rate_hz)
    return side.but(recorded=anchored(side, recorded))


def _check(samples, inputs):
    """Check that inputs are in the rows of a record and that they do anything."""
    if len(inputs.values) != len(samples.values):
        raise ValueError(f'the inputs have {len(inputs.values)} rows, the record '
                         f'{len(samples.values)}; give inputs in the rows of the record')
    for name, column in zip(inputs.channels, inputs.values.T):
        share = np.mean(~np.isfinite(column))
        if share > LIMITS.missing.value:
            raise ValueError(f'the recorded input {name} lacks {100 * share:.2g} % of the rows of '
                             f'the record; at most {100 * LIMITS.missing.value:g} % can be '
                             'filled: cut the bag, or leave the input out')
        if not np.nanstd(column) > 0.0:
            raise ValueError(f'the recorded input {name} is {np.nanmean(column):g} throughout: '
                             'it moves nothing; is it the right topic and field?')


def _whole(simulator, samples, inputs):
    """Return the inputs without mean, rows that are missing as the channels say, (n, m)."""
    values = inputs.values - np.nanmean(inputs.values, axis=0)
    gone = np.isnan(values)
    if not gone.any():
        return values
    crude = RecordedInputs(inputs.channels, np.where(gone, 0.0, values), samples.rate_hz,
                           first=False)
    both = np.hstack([values, samples.values - np.nanmean(samples.values, axis=0)])
    whole = filled(simulator.but(recorded=crude), Samples(
        both, samples.rate_hz, inputs.channels + samples.channels))
    return whole.values[:, :values.shape[1]]


def observed(simulator, recorded, samples, limits):
    """Return the model side, samples and limits beside the inputs; see `beside_inputs`."""
    rest = samples.values - recorded.base
    taken = recorded.base + ringing(recorded.anchor, recorded, rest - np.nanmean(rest, axis=0))
    recorded = replace(recorded, taken=taken)
    none = np.full(recorded.values.shape, np.nan)
    return (simulator.but(recorded=recorded),
            replace(samples, values=np.hstack([recorded.values, samples.values - taken]),
                    channels=recorded.names + samples.channels),
            np.hstack([none, limits - taken]))


def simulated_beside(simulator, setup, seed, effects):
    """Return Samples and limits, as a record beside its inputs is, of a setup that they drive."""
    recorded = simulator.recorded
    samples = simulate_setup(played(setup, recorded), seed)
    return observed(simulator, recorded, *without_clipped(samples, effects))[1:]


def remainder(simulator, samples, levels, candidate):
    """
    Return a model side without inputs, and what a candidate leaves of a record beside them.

    Parameters
    ----------
    simulator : Simulator
        With recorded inputs.
    samples : Samples
        A record beside them.
    levels : ndarray
        Of the model's other inputs.
    candidate : Candidate
        Whose response to the inputs is taken from the channels.

    Returns
    -------
    Simulator, Samples
        Of the channels alone.

    """
    recorded, known = simulator.recorded, simulator.known
    values = samples.values[:, known:]
    if candidate.effects:
        setup = simulator.setup(candidate, levels)
        base = response(setup, recorded)
        rest = values + recorded.taken - base
        values = rest - ringing(setup, recorded, rest - np.nanmean(rest, axis=0))
    return simulator.but(recorded=None), replace(
        samples, values=values, channels=samples.channels[known:])


def unpredicted(simulator, fitted, evidence):
    """
    Return expected spectra of the channels themselves, and their evidence, beside the inputs.

    Swapped channels or a wrong unit show in the channels, not in what a prediction leaves of them.
    The spectra, (k, l, l), are at nominal and at fitted levels.
    """
    recorded, known, frame = simulator.recorded, simulator.known, evidence.frame
    side = simulator.of_inputs(anchor=None, first=False, shown=False)
    found = side.expected(Candidate())
    predicted = tapered_dft(recorded.taken, frame.taper, frame.begins)[:, frame.first:frame.last]
    channels = Evidence(frame, evidence.spectrum[..., known:] + predicted, evidence.segments)
    return (found.at_nominal.mean(axis=0), found.at(fitted.levels).mean(axis=0), channels)


def faults_of_inputs(simulator, samples):
    """Return the fault of an input that has a wrong sign or unit, for `samples` beside it."""
    recorded, known = simulator.recorded, simulator.known
    base, channels = recorded.base, samples.values[:, known:] + recorded.taken
    there = np.isfinite(channels).all(axis=1)
    base, channels = base[there], channels[there]
    scale = channels.std(axis=0) + 1e-300
    base, channels = ((v - v.mean(axis=0)) / scale for v in (base, channels))
    power = np.sum(base ** 2)
    factor = float(np.sum(base * channels) / max(power, 1e-300))
    coherence = factor ** 2 * power / np.sum(channels ** 2)
    if coherence < LIMITS.coherent.value or 1 / LIMITS.factor.value < factor < LIMITS.factor.value:
        return ()
    what = 'a wrong sign' if abs(np.log(abs(factor))) < np.log(LIMITS.factor.value) else (
        'another unit' if factor > 0 else 'a wrong sign and another unit')
    return (Fault('input', dict.fromkeys(recorded.names, factor),
                  f'The recorded input {", ".join(recorded.names)} has {what}: the channels '
                  f'follow it times {factor:.3g}.', 0.0),)
