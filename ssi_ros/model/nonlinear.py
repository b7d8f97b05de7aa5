"""
Nonlinear hinges and the gyroscopic moment of a turning hub, eq. (13) and (38), (39).

The linear part, hinge stiffness included, is propagated exactly as in `simulator.py`, but on a
finer internal step over which the nonlinear torque is held. That torque is found implicitly
(midpoint for what stores energy, end of step for friction and for the give of the higher modes),
so that stiffness and stiction do not limit the step. A hinge that sticks creeps within its step:
at 1 kHz that raises the lowest frequency by 0.1 %, at 4 kHz by less than 0.01 %.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.model.excitation import begin_all, generator
from ssi_ros.model.simulator import check_rate, stationary_start
from ssi_ros.records import Samples

KINDS = ('freeplay', 'friction', 'cubic')
MOST_GAIN = 0.5     # of the torque through the motion in a step: below, its equation has one root


@dataclass(frozen=True)
class HingeLaw:
    """
    What the hinge of an array does besides its linear stiffness, eq. (38).

    Attributes
    ----------
    hinge : str
        Input that is the torque about it, such as 'E1_hinge'; the same row reads its angle.
    kind : str
        'freeplay': no moment within +-size [rad]; 'friction': Coulomb torque size [N m];
        'cubic': moment size alpha^3, [N m/rad^3].
    size : float
        As `kind` says; 0 changes nothing.
    stiffness_n_m_rad : float, optional
        Linear stiffness of the hinge, which the system has already; that of its freedom where
        the hinge is one.

    """

    hinge: str
    kind: str
    size: float
    stiffness_n_m_rad: float | None = None

    def __post_init__(self):
        if self.kind not in KINDS:
            raise ValueError(f'kind={self.kind!r} must be one of {", ".join(KINDS)}')
        if not (np.isfinite(self.size) and self.size >= 0.0):
            raise ValueError(f'size={self.size:g} of the {self.kind} must be zero or more')

    def torques(self, angle, give):
        """
        Compute the torque along a motion, without what it does to that motion.

        Parameters
        ----------
        angle : ndarray, shape (n,), [rad]
            What the modes and the loads turn the hinge by.
        give : float
            What a torque of 1 N m turns it by at once [rad/(N m)].

        Returns
        -------
        ndarray, shape (n,), [N m]

        """
        from ssi_ros.model.hinge_steps import follow

        return follow(KINDS.index(self.kind), self.size, self.stiffness_n_m_rad,
                      np.ascontiguousarray(angle, dtype=float), give)


def simulate_nonlinear(system, duration_s, seed, *, laws=(), gyroscopic=False, excitation=None,
                       at_rest=False, substeps=10, rate0_rad_s=(0.0, 0.0, 0.0), state0=None,
                       start_ns=0):
    """
    Simulate a record with nonlinear hinges, the gyroscopic moment, or both.

    Parameters
    ----------
    system : System
        Of `assemble` with `explicit_hinges` or `hinge_inputs`, without filters.
    duration_s, seed, excitation, at_rest, start_ns
        As in `simulate`; the stationary start is that of the linear system.
    laws : tuple of HingeLaw
        At most one a hinge.
    gyroscopic : bool
        Include theta' x J theta', with J the inertia of the undeformed body.
    substeps : int
        Internal steps a sample.
    rate0_rad_s : tuple of three float
        Turn of the hub at the start [rad/s], on top of its vibration.
    state0 : dict of str to float, optional
        States of the linear system, such as {'E1_hinge': 0.01}, in place of the stationary ones.

    Returns
    -------
    samples : Samples
        The record.
    rates : ndarray, shape (n, 3), [rad/s]
        Angular rate of the hub at every sample.

    Raises
    ------
    ValueError
        If a hinge does not exist, or is too stiff for the internal step.

    """
    from ssi_ros.model.hinge_steps import march

    _check(system, laws, substeps)
    rate_hz = system.rate_hz
    check_rate(system, rate_hz)
    count = int(round(duration_s * rate_hz)) if np.isfinite(duration_s) else 0
    if count < 1:
        raise ValueError(f'duration_s={duration_s:g} must be at least one sample')
    parts = system.excitation if excitation is None else tuple(excitation)
    space = system.plant
    sampled = space.discrete(rate_hz * substeps)
    forces = begin_all(parts, rate_hz, system.inputs, seed)(0, count)
    z = np.zeros(len(sampled.poles), complex)
    if state0 is not None:
        z = sampled.inverse @ np.array([state0.get(name, 0.0) for name in space.states])
    elif not at_rest:
        z = stationary_start(space.discrete(rate_hz), parts, system.inputs, seed)

    # Rows that read angle and speed of each hinge, and the flexible momentum H X_f' of the hub.
    to_state = sampled.vectors * sampled.weight
    where = {name: i for i, name in enumerate(space.states)}
    hinges = [law.hinge for law in laws]
    act = [system.inputs.index(h) for h in hinges]
    # A hinge lies in the arrays: the hub, whose attitude may be no state, does not turn it.
    turn, moving = system.input[3:, act].T, system.dofs[3:]
    gives = np.array([d.endswith('_give') for d in moving])
    angle = (turn * ~gives) @ to_state[[where[d] for d in moving]]
    speed = (turn * ~gives) @ to_state[[where[d + '_rate'] for d in moving]]
    give = (turn * gives) @ to_state[[where[d] for d in moving]]
    momentum = system.mass[:3, 3:] @ to_state[[where[d + '_rate'] for d in system.dofs[3:]]]
    inertia = system.mass[:3, :3]
    torque_of = system.input[:3]
    stiffness = np.array([_stiffness(system, law) for law in laws])
    if laws:
        # The give takes the whole of the rest, with which the equation still has one root.
        swing = np.einsum('hs,sh->h', angle, sampled.b[:, act]).real / 2
        for law, gain in zip(laws, stiffness * swing):
            if law.kind == 'freeplay' and gain > MOST_GAIN:
                raise ValueError(f'{law.hinge} is too stiff for the internal step (gain '
                                 f'{gain:.2g} over {MOST_GAIN:g}); raise substeps={substeps}')
    turning = inertia @ np.array(rate0_rad_s, float) + (momentum @ z).real
    states, extra, gyro, rates = march(
        z, sampled.poles, forces @ sampled.b.T, np.ascontiguousarray(sampled.b[:, act].T),
        np.ascontiguousarray(angle), np.ascontiguousarray(speed), np.ascontiguousarray(give),
        np.array([KINDS.index(law.kind) for law in laws], dtype=np.int64),
        np.array([law.size for law in laws], dtype=float), stiffness, substeps,
        np.ascontiguousarray(momentum), np.ascontiguousarray(inertia),
        np.linalg.inv(inertia), turning,
        forces @ torque_of.T, 1.0 / (rate_hz * substeps),
        np.ascontiguousarray(sampled.b[:, :3].T), gyroscopic)
    c = sampled.c * sampled.weight
    values = (states @ c.T).real + forces @ sampled.d.T + extra @ sampled.d[:, act].T
    values = values + gyro @ sampled.d[:, :3].T
    for stage in system.chain:
        values = stage.begin(rate_hz, generator(seed, stage.name))(values)
    return Samples(values, rate_hz, system.channels, start_ns), rates


def _check(system, laws, substeps):
    if substeps < 1:
        raise ValueError(f'substeps={substeps} must be at least 1')
    if system.shaping is not None or system.conditioning is not None:
        raise ValueError('filters are not part of the nonlinear simulation; shape the excitation '
                         'or filter the record instead')
    hinges = [i for i in system.inputs if i.endswith('_hinge')]
    for law in laws:
        if law.hinge not in hinges:
            raise ValueError(f'hinge={law.hinge!r} is not on this system, which has '
                             f'{", ".join(hinges) or "none"}; give the array a finite '
                             'hinge_n_m_rad and assemble with explicit_hinges=True')
        _stiffness(system, law)
    if len({law.hinge for law in laws}) < len(laws):
        raise ValueError('a hinge has two laws; give each hinge one')


def _stiffness(system, law):
    if law.stiffness_n_m_rad is not None:
        return law.stiffness_n_m_rad
    if law.hinge not in system.dofs:
        raise ValueError(f'{law.hinge} is no freedom of this system; give its law the '
                         'stiffness_n_m_rad of the hinge')
    at = system.dofs.index(law.hinge)
    return system.stiffness[at, at]
