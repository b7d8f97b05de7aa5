"""
Numbers that wander over a record, which no effect of the library does, eq. (105c).

Gains that follow the temperature, arrays that turn after the sun: each piece of a record looks
right by itself or nearly so, and all together too, where the mean is that of the model.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import effect_class
from ssi_ros.effects.edits import mix, scale_stiffness
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.likelihood import whiten_each
from ssi_ros.gap.scores import Scores
from ssi_ros.gap.strangers import Stranger, templates_of

SHAPES = 4              # half periods of a cosine over the record
LITTLE = 1.01           # of every number


def make_wanderers(simulator):
    """Compute the templates of numbers that may wander, each as if it were another for good."""
    return templates_of(simulator, ((Stranger(t), setup) for t, setup in _setups(simulator)))


def _setups(simulator):
    """Yield what wanders, and the setup that has it changed for good."""
    setup = simulator.setup(Candidate())
    system = setup.system
    for channel in system.channels:
        for name, text in (('sensor_gain', 'the gain'), ('sensor_noise', 'the noise')):
            effect = effect_class(name)(channel=channel, scale=LITTLE)
            yield f'{text} of {channel}', effect.apply(setup)
    arrays = tuple(a.name for a in simulator.spacecraft.arrays)
    for some in dict.fromkeys([*((a,) for a in arrays), arrays]):
        text = some[0] if len(some) == 1 else 'all arrays'
        if len(some) == 1:          # of all it is the level
            gains = np.diag([LITTLE if s.array in some else 1.0
                             for s in simulator.spacecraft.sensors])
            yield f'the gain of all of {text}', mix(setup, gains)
        stiff = scale_stiffness(system, some, LITTLE)
        yield f'the stiffness of {text}', replace(setup, system=stiff)
        rows = np.array([d.split('_eta')[0] in some for d in system.dofs])
        between = np.not_equal.outer(rows, rows)
        yield (f'the coupling of {text} with the hub',
               replace(setup, system=replace(system, mass=np.where(
                   between, LITTLE * system.mass, system.mass))))
    rows = np.array(['_eta' in d for d in system.dofs])
    damped = np.where(np.outer(rows, rows), LITTLE * system.damping, system.damping)
    yield 'the damping of all modes', replace(setup, system=replace(system, damping=damped))


def wandering(here, fitted, evidence):
    """
    Score numbers that wander.

    The levels of all excitation and of all noise may wander: that is another effect, and is left
    out.

    Parameters
    ----------
    here : Directions
        Of the templates of `make_wanderers`.
    fitted : Fit
        A model and its levels.
    evidence : Evidence
        What was recorded.

    Returns
    -------
    Scores
        Of every wanderer in SHAPES shapes; as many as the pieces can tell.

    """
    frame, pieces = evidence.frame, np.array(evidence.pieces)
    each = whiten_each(fitted.plain, evidence).excess
    levels = here.basis[:len(fitted.levels)]
    apart = here.flat - (here.flat @ levels.T) @ np.linalg.pinv(levels @ levels.T) @ levels
    halves = np.arange(min(SHAPES, len(pieces) - 1) + 1)
    # orthogonal to what stays the same, although pieces are missing
    shapes = np.linalg.qr(np.cos(np.pi * np.outer(pieces + 0.5, halves) / frame.pieces))[0][:, 1:]
    inner = (apart @ apart.T).astype(float)
    spread = np.sqrt(np.maximum(np.diag(inner), 1e-30) * frame.crowding)
    z = (apart @ each.T @ shapes) / spread[:, None]
    cosine = np.kron(np.eye(shapes.shape[1]), inner / np.outer(spread, spread) * frame.crowding)
    texts = tuple(replace(w, text=f'{w.text} that wanders') for w in here.effects)
    count = shapes.shape[1]
    return Scores(texts * count, z.T.ravel().astype(float), np.tile(1.0, z.size),
                  np.tile(spread, count), cosine)
