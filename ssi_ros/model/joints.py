"""
Friction and play between two points of a structure that somebody else has modelled, eq. (38).

The linear part is propagated exactly on an internal step over which the force of a joint is held.
That force is found implicitly at the middle of the step, so that its stiffness does not limit the
step.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.model.excitation import begin_all, generator
from ssi_ros.model.simulator import check_rate, stationary_start
from ssi_ros.model.system import in_modes, is_held
from ssi_ros.records import Samples

KINDS = ('freeplay', 'friction')
MOST_GAIN = 0.5         # of a spring with play over a step: below, its equation has one root


@dataclass(frozen=True)
class JointLaw:
    """
    What acts between two points besides the linear system.

    Attributes
    ----------
    hinge : str
        Input that is the force between them; the same column reads their distance.
    kind : str
        'freeplay': the spring `stiffness`, which the system has, does not act within +-size;
        'friction': a spring `stiffness`, which it has not, in series with a slider that holds up
        to the force `size` (Jenkins element).
    size : float
        As `kind` says; 0 changes nothing.
    stiffness : float
        Of that spring.

    """

    hinge: str
    kind: str
    size: float
    stiffness: float

    def __post_init__(self):
        if self.kind not in KINDS:
            raise ValueError(f'kind={self.kind!r} must be one of {", ".join(KINDS)}')
        if not (np.isfinite(self.size) and self.size >= 0.0 and self.stiffness > 0.0):
            raise ValueError(f'size={self.size:g} of the {self.kind} must be zero or more, and '
                             f'its stiffness={self.stiffness:g} positive')

    def torques(self, distance, give):
        """Return the force along a motion (n,); `give` is 0, as the system has all of it."""
        from ssi_ros.model.joint_steps import follow

        return follow(KINDS.index(self.kind), self.size, self.stiffness,
                      np.ascontiguousarray(distance, dtype=float))


def simulate_joints(system, duration_s, seed, laws, *, at_rest=False, start_ns=0):
    """
    Simulate a record with friction or play.

    Parameters
    ----------
    system : System
        With an input for every law, and without filters.
    duration_s, seed, at_rest, start_ns
        As in `simulate`; the stationary start is that of the linear system.
    laws : tuple of JointLaw
        At most one for each pair of points.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError
        If nothing holds a point, or a spring with play is too stiff for the internal step.

    """
    from ssi_ros.model.joint_steps import march, SUBSTEPS

    rate_hz, parts, act = system.rate_hz, system.excitation, _columns(system, laws)
    check_rate(system, rate_hz)
    count = round(duration_s * rate_hz)
    sampled = system.plant.discrete(rate_hz * SUBSTEPS)
    forces = begin_all(parts, rate_hz, system.inputs, seed)(0, count)
    z = np.zeros(len(sampled.poles), complex)
    if not at_rest:
        z = stationary_start(system.plant.discrete(rate_hz), parts, system.inputs, seed)
    distance = distance_rows(system, act) @ (sampled.vectors * sampled.weight)
    kick = np.ascontiguousarray(sampled.b[:, act].T)
    kinds = np.array([KINDS.index(law.kind) for law in laws])
    stiffness = np.array([law.stiffness for law in laws])
    gain = stiffness * np.einsum('hs,hs->h', distance, kick).real / 2
    for law, one in zip(laws, gain):
        if law.kind == 'freeplay' and one > MOST_GAIN:
            raise ValueError(f'the spring between {law.hinge} is too stiff for play at '
                             f'rate_hz={rate_hz:g} (gain {one:.2g} over {MOST_GAIN:g}); raise '
                             'rate_hz')
    states, extra = march(z, sampled.poles, forces @ sampled.b.T, kick,
                          np.ascontiguousarray(distance), kinds,
                          np.array([law.size for law in laws], dtype=float), stiffness)
    values = ((states @ (sampled.c * sampled.weight).T).real + forces @ sampled.d.T
              + extra @ sampled.d[:, act].T)
    for stage in system.chain:
        values = stage.begin(rate_hz, generator(seed, stage.name))(values)
    return Samples(values, rate_hz, system.channels, start_ns)


def distance_rows(system, columns):
    """Return the rows that read the distances that inputs act on from the states, (h, states)."""
    rows = system.input[:, columns].T
    loose = [system.inputs[c] for c, row in zip(columns, rows) if not is_held(system, row)]
    if loose:
        raise ValueError(f'no spring holds {", ".join(loose)}; friction and play need points that '
                         'a spring holds')
    if system.turned:
        # the states are modes; what moves as a rigid body has no position among them, and
        # changes no distance between two points of one body
        system = in_modes(system)
        rows = np.where(system.stiffness.any(axis=0), system.input[:, columns].T, 0.0)
    states = system.plant.states
    where = [states.index(d) if d in states else 0 for d in system.dofs]
    out = np.zeros((len(rows), len(states)))
    for i, at in enumerate(where):
        out[:, at] += rows[:, i]
    return out


def _columns(system, laws):
    if system.shaping is not None or system.conditioning is not None:
        raise ValueError('filters are not part of the nonlinear simulation; leave them out')
    if len({law.hinge for law in laws}) < len(laws):
        raise ValueError('friction or play is given twice between the same points; give it once')
    return [system.inputs.index(law.hinge) for law in laws]
