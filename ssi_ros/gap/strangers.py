"""
Known shapes of gaps that no effect of the library makes, eq. (105a).

What is not in the library is told from the nearest effect by what that leaves. A test that looks
everywhere hardly minds little of it; one that knows the shape does.
"""
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from ssi_ros.effects.edits import add_part
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.expected import expected
from ssi_ros.gap.fit import Simulator
from ssi_ros.gap.scores import power_of, Templates
from ssi_ros.gap.symptoms import Oddity, SURE
from ssi_ros.model.excitation import Coloured, White

CORNERS_HZ = (0.1, 0.5, 2.0)    # of a torque that switches or wanders
TORQUE = 0.1            # of the nominal torque, rms
DAMPING = 1.1


@dataclass(frozen=True)
class Stranger:
    """What a gap may look like, and whether only more of it than in the model is possible."""

    text: str
    adds: bool


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
    setup = simulator.setup(Candidate())
    nominal = expected(setup, simulator.frame)
    base = nominal.at(np.ones(len(nominal.names)))
    torque = TORQUE * max(simulator.spacecraft.excitation.torque_rms_n_m)
    kept, changes = [], []

    def keep(stranger, there):
        change = (there.at(np.ones(len(there.names))) - base).mean(axis=0)
        if np.any(np.abs(change) > 1e-12 * np.abs(base).max()):
            kept.append(stranger)
            changes.append(change.astype(np.complex64))

    for name in (n for n in setup.system.inputs if n.startswith('torque')):
        axis = name.split('_')[1]
        white = White(f'strange {name}', (name,), (torque,))
        if name != 'torque_x':
            keep(Stranger(f'random torque about {axis}', True),
                 expected(add_part(setup, white), simulator.frame))
            continue
        for corner_hz in CORNERS_HZ:
            keep(Stranger(f'a torque about {axis} slower than {corner_hz:g} Hz', True),
                 expected(add_part(setup, Coloured(white, corner_hz)), simulator.frame))
    for array in simulator.spacecraft.arrays:
        other = replace(simulator.spacecraft, arrays=tuple(
            replace(a, damping_ratio=a.damping_ratio * DAMPING) if a.name == array.name else a
            for a in simulator.spacecraft.arrays))
        keep(Stranger(f'other damping of {array.name} than of the rest', False), Simulator(
            other, simulator.frame, simulator.duration_s, simulator.present).expected(Candidate()))
    return Templates(tuple(kept), np.array(changes), {}, power_of(nominal.shares[:-1]))


def strange_sign(scores):
    """Return the sign of the likeliest stranger, if one is there: none or one Oddity."""
    adds = np.array([s.adds for s in scores.effects])
    tails = np.where(adds, norm.sf(scores.z), 2 * norm.sf(np.abs(scores.z)))
    best = int(np.argmin(tails))
    p = float(min(1.0, len(tails) * tails[best]))
    if p > SURE:
        return ()
    return (Oddity('a stranger', p, f'it looks like {scores.effects[best].text}, '
                   f'{abs(scores.z[best]):.1f} sd'),)
