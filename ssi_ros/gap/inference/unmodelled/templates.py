"""
Templates of changes of a model that no effect of the library makes, eq. (105a) and (105c).

A test over all bins has little power against a small change; one that knows its shape has more.
Drifts of gains and stiffness may leave the mean over the record as the model has it.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects.base import Site
from ssi_ros.effects.edits import add_part, mix, scale_stiffness
from ssi_ros.effects.library import library
from ssi_ros.effects.points import single_modes, with_mode
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.score_test import Directions, Templates
from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.spectra.expected_periodogram import power_of
from ssi_ros.hermitian import hermitian, inverse_root
from ssi_ros.model.excitation import Coloured, source, White
from ssi_ros.updating.merged_bins import merged, white_changes
from ssi_ros.updating.model_uncertainty import no_uncertainty
from ssi_ros.updating.score_variance import energies, score_std
from ssi_ros.weighted_sums import mean_of

CORNERS_HZ = (0.1, 0.5, 2.0)    # of a slow torque
TORQUE = 0.1            # of the nominal torque, rms
DAMPING = 1.1
STIFFNESS = 1.002       # of one mode
DRIFT = 1.01            # of a number that drifts
OUTSIDE = Site.EXCITATION.value


@dataclass(frozen=True)
class UnmodelledChange:
    """A change of the model that no effect of the library makes."""

    text: str
    positive: bool = False  # whether only more of it than in the model is possible
    modal: bool = False     # one number of one mode, which may change together with all others
    scatter: float = 1.0    # deviation of its score over that of independent bins and segments
    count: float = np.inf   # independent energies of the mode that its score is a mean of
    damped: tuple = None    # frequency [Hz] and decay [1/s] of the mode whose damping it is
    site: str = Site.STRUCTURE.value    # where it is, empty if that is not known


@dataclass(frozen=True, eq=False)
class ChangeTemplates:
    """Templates, each with an UnmodelledChange for every effect: of constant ones and drifts."""

    constant: Templates
    drifting: Templates


def make_change_templates(simulator):
    """Compute all templates of unmodelled changes around a simulator's nominal spectrum."""
    return ChangeTemplates(constant_templates(simulator), _in_runs(
        _templates_of(simulator, _drifts(simulator))))


def constant_templates(simulator):
    """Compute the templates of changes that stay over a record, with their scatter, (105b)."""
    templates = _templates_of(simulator, _constant_changes(simulator))
    frame, changes = simulator.frame, list(templates.effects)
    nominal = simulator.expected(Candidate())
    model = nominal.at_nominal.mean(axis=0)
    here = Directions(templates, model[None], nominal.shares,
                      no_uncertainty(frame, model.shape[-1]), frame, tuple(range(frame.segments)))
    lower = inverse_root(model)
    for i, change in enumerate(changes):
        if change.damped is None:
            continue
        at_hz, rate = change.damped
        count, share = energies(rate * simulator.duration_s)
        decay, scatter = rate * frame.rows / frame.rate_hz, 1.0
        if decay < LIMITS.slow_decay.value:
            rest = here.flat[i] - here.mixed[i] @ here.inner @ here.basis
            scatter = max(1.0, np.sqrt(share) * score_std(
                simulator, hermitian(rest.reshape(model.shape)), lower, at_hz, decay))
        changes[i] = replace(change, scatter=scatter, count=count)
    return _in_runs(replace(templates, effects=tuple(changes)))


def _in_runs(templates):
    """Return Templates of every bin in the runs of bins that scores need."""
    white = templates.white
    return replace(templates, white=merged(white.vectors, white.factor))


def _templates_of(simulator, changes):
    """Return the templates of pairs of an UnmodelledChange and the setup that has it."""
    nominal = simulator.expected(Candidate())
    base, kept, spectra = mean_of(nominal.few_at_nominal), [], []
    for change, setup in changes:
        spectrum = mean_of(simulator.spectrum(setup).few_at_nominal) - base
        if np.any(np.abs(spectrum) > 1e-12 * np.abs(base).max()):
            kept.append(change)
            spectra.append(spectrum.astype(np.complex64))
    return Templates(tuple(kept), white_changes(np.array(spectra), base), {},
                     power_of(nominal.shares[:-1]))


def _constant_changes(simulator):
    """Yield every constant change, and the setup that has it."""
    setup = simulator.setup(Candidate())
    system = setup.system
    white_parts = [p for p in map(source, system.excitation) if isinstance(p, White)]
    rms_of = {i: rms for p in white_parts for i, rms in zip(p.inputs, p.rms)}
    named = {n: f'torque about {n.split("_")[1]}' for n in system.inputs if n.startswith('torque_')
             } if simulator.spacecraft.arrays else {n: f'input {n}' for n in system.inputs}
    for name, text in named.items():
        rms = rms_of.get(name) or max(rms_of.get(n, 0.0) for n in named)
        white = White(f'unmodelled {name}', (name,), (TORQUE * rms,))
        if not rms_of.get(name):
            yield UnmodelledChange(f'a random {text}', True, site=OUTSIDE), add_part(setup, white)
        for corner_hz in CORNERS_HZ if rms_of.get(name) else ():
            yield (UnmodelledChange(f'power below {corner_hz:g} Hz in the {text}', True,
                                    site=OUTSIDE), add_part(setup, Coloured(white, corner_hz)))
    freedoms = [(i, *d.split('_eta')) for i, d in enumerate(system.dofs) if '_eta' in d]
    for array in dict.fromkeys(a for _, a, _ in freedoms):
        rows = [i for i, a, _ in freedoms if a == array]
        yield (UnmodelledChange(f'other damping of {array} than of the rest'),
               _scaled(setup, 'damping', rows, DAMPING))
    for i, array, mode in freedoms:
        # a frequency shows in the phase, random in each segment; only a damping is an energy
        at = (np.sqrt(system.stiffness[i, i] / system.mass[i, i]) / (2 * np.pi),
              system.damping[i, i] / system.mass[i, i] / 2)
        for name, factor, text, of in (('stiffness', STIFFNESS, 'frequency', None),
                                       ('damping', DAMPING, 'damping', at)):
            yield (UnmodelledChange(f'another {text} of mode {mode} of {array} alone', modal=True,
                                    damped=of), _scaled(setup, name, [i], factor))
    for number, at in () if simulator.spacecraft.arrays else single_modes(system):
        for text, of, factor in ('frequency', None, STIFFNESS ** 0.5), ('damping', at, DAMPING):
            moved = replace(setup, system=with_mode(system, number, **{text: factor}))
            yield UnmodelledChange(f'another {text} of mode {number} alone', modal=True,
                                   damped=of), moved


def _drifts(simulator):
    """Yield what may drift, and the setup that has it changed for good."""
    setup = simulator.setup(Candidate())
    system = setup.system

    def of_system(**matrices):
        return replace(setup, system=replace(system, **matrices))

    for channel in system.channels:
        for cls in (e for e in library().values() if e.may_vary):
            yield (UnmodelledChange(f'a drift of {cls.may_vary} of {channel}',
                                    site=cls.site.value),
                   cls(channel=channel, **{cls.size: DRIFT}).apply(setup))
    arrays = tuple(a.name for a in simulator.spacecraft.arrays)
    for some in dict.fromkeys([*((a,) for a in arrays), arrays]):
        text = some[0] if len(some) == 1 else 'all arrays' if some else 'the structure'
        if len(some) == 1:          # of all it is the level
            gains = np.diag([DRIFT if s.array in some else 1.0
                             for s in simulator.spacecraft.sensors])
            yield UnmodelledChange(f'a drift of the gain of all of {text}', site=''), mix(
                setup, gains)
        yield (UnmodelledChange(f'a drift of the stiffness of {text}'),
               replace(setup, system=scale_stiffness(system, some, DRIFT)))
        rows = np.array([d.split('_eta')[0] in some for d in system.dofs])
        between = np.not_equal.outer(rows, rows)
        # weaker, not stronger: of modes that carry nearly all of an array's mass none could exist
        yield (UnmodelledChange(f'a drift of the coupling of {text} with the hub'),
               of_system(mass=np.where(between, system.mass / DRIFT, system.mass)))
    rows = np.array(['_eta' in d or not arrays for d in system.dofs])
    yield (UnmodelledChange('a drift of the damping of all modes'), of_system(
        damping=np.where(np.outer(rows, rows), DRIFT * system.damping, system.damping)))


def _scaled(setup, name, rows, factor):
    """Return the setup with stiffness or damping of freedoms times a factor."""
    matrix = getattr(setup.system, name).copy()
    matrix[rows, rows] *= factor
    return replace(setup, system=replace(setup.system, **{name: matrix}))
