"""
Known shapes of gaps that no effect of the library makes, eq. (105a).

What is not in the library is told from the nearest effect by what that leaves. A test that looks
everywhere hardly minds little of it; one that knows the shape does.
"""
from dataclasses import dataclass, replace

import numpy as np
from ssi_ros.effects.edits import add_part
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.expected import expected
from ssi_ros.gap.likelihood import hermitian
from ssi_ros.gap.ringing import energies, repeats
from ssi_ros.gap.scores import Directions, power_of, Templates
from ssi_ros.gap.tolerance import no_tolerance
from ssi_ros.model.excitation import Coloured, White

CORNERS_HZ = (0.1, 0.5, 2.0)    # of a torque that switches or wanders
TORQUE = 0.1            # of the nominal torque, rms
DAMPING = 1.1
STIFFNESS = 1.002       # of one mode
SLOW = 8.0              # decay in a piece above which its bins and pieces are independent


@dataclass(frozen=True)
class Damped:
    """Where the damping of a mode is: its frequency [Hz], and its decay rate [1/s]."""

    at_hz: float
    rate: float


@dataclass(frozen=True)
class Stranger:
    """
    What a gap may look like.

    Attributes
    ----------
    text : str
        In words.
    adds : bool
        Whether only more of it than in the model is possible.
    modal : bool
        Whether it is one number of one mode, which may come together with all others.
    scatter : float
        By how much its score scatters more than if bins and pieces were independent.
    count : float
        How many independent energies of the mode its score is a mean of.
    damped : Damped, optional
        The mode whose damping it is.

    """

    text: str
    adds: bool = False
    modal: bool = False
    scatter: float = 1.0
    count: float = np.inf
    damped: Damped = None


def make_strangers(simulator):
    """
    Compute the templates of strangers around the simulator's nominal spectrum.

    Parameters
    ----------
    simulator : Simulator
        Model side.

    Returns
    -------
    Templates
        With a Stranger for every effect.

    """
    return _scattered(templates_of(simulator, _strangers(simulator)), simulator)


def templates_of(simulator, strangers):
    """Return the templates of strangers, pairs of a Stranger and the setup that has it."""
    nominal = simulator.expected(Candidate())
    base = nominal.at(np.ones(len(nominal.names)))
    kept, changes = [], []
    for stranger, setup in strangers:
        there = expected(setup, simulator.frame)
        change = (there.at(np.ones(len(there.names))) - base).mean(axis=0)
        if np.any(np.abs(change) > 1e-12 * np.abs(base).max()):
            kept.append(stranger)
            changes.append(change.astype(np.complex64))
    return Templates(tuple(kept), np.array(changes), {}, power_of(nominal.shares[:-1]))


def _scattered(strangers, simulator):
    """Return the templates with the scatter that dampings of slow modes have, eq. (105b)."""
    frame, kept = simulator.frame, list(strangers.effects)
    nominal = simulator.expected(Candidate())
    model = nominal.at(np.ones(len(nominal.names))).mean(axis=0)
    here = Directions(strangers, model[None], nominal.shares,
                      no_tolerance(frame, model.shape[-1]), frame, tuple(range(frame.pieces)))
    lower = np.linalg.inv(np.linalg.cholesky(model))
    for i, mode in enumerate(s.damped for s in strangers.effects):
        if mode is None:
            continue
        count, share = energies(mode.rate * simulator.duration_s)
        decay = mode.rate * frame.rows / frame.rate_hz
        scatter = 1.0
        if decay < SLOW:
            rest = here.flat[i] - here.mixed[i] @ here.inner @ here.basis
            scatter = max(1.0, np.sqrt(share) * repeats(
                simulator, hermitian(rest.reshape(model.shape)), lower, mode.at_hz, decay))
        kept[i] = replace(kept[i], scatter=scatter, count=count)
    return replace(strangers, effects=tuple(kept))


def _strangers(simulator):
    """Yield every stranger, and the setup that has it."""
    setup = simulator.setup(Candidate())
    system = setup.system
    torque = TORQUE * max(simulator.spacecraft.excitation.torque_rms_n_m)
    for name in (n for n in system.inputs if n.startswith('torque')):
        axis = name.split('_')[1]
        white = White(f'strange {name}', (name,), (torque,))
        if name != 'torque_x':
            yield Stranger(f'random torque about {axis}', True), add_part(setup, white)
            continue
        for corner_hz in CORNERS_HZ:
            yield (Stranger(f'a torque about {axis} slower than {corner_hz:g} Hz', True),
                   add_part(setup, Coloured(white, corner_hz)))
    freedoms = [(i, *d.split('_eta')) for i, d in enumerate(system.dofs) if '_eta' in d]
    for array in dict.fromkeys(a for _, a, _ in freedoms):
        rows = [i for i, a, _ in freedoms if a == array]
        yield (Stranger(f'other damping of {array} than of the rest'),
               _scaled(setup, 'damping', rows, DAMPING))
    for i, array, mode in freedoms:
        # a frequency shows in the phase, which each piece tells anew: only a damping is an energy
        at = Damped(np.sqrt(system.stiffness[i, i] / system.mass[i, i]) / (2 * np.pi),
                    system.damping[i, i] / system.mass[i, i] / 2)
        for name, factor, text, of in (('stiffness', STIFFNESS, 'frequency', None),
                                       ('damping', DAMPING, 'damping', at)):
            yield (Stranger(f'another {text} of mode {mode} of {array} alone', modal=True,
                            damped=of), _scaled(setup, name, [i], factor))


def _scaled(setup, name, rows, factor):
    """Return the setup with stiffness or damping of freedoms times a factor."""
    matrix = getattr(setup.system, name).copy()
    matrix[rows, rows] *= factor
    return replace(setup, system=replace(setup.system, **{name: matrix}))
