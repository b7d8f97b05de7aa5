"""
Where to put k accelerometers on the arrays, eq. (35) and (36) of docs/theory.md.

The score of a layout is the mean log precision that it allows on the frequencies of the modes of
interest. Particle swarm optimisation, the paper's way, maximises it over all points; effective
independence (Kammer, J. Guidance 14(2), 1991) takes the least useful of many candidates away, one
after the other, and is here the quick start and the check.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.model.information import information, modal_view, spreads
from ssi_ros.model.structure import displacement_row

LEAST_PRECISION = 1e-6      # of a mode that a layout cannot see at all, keeps the score finite
INERTIA, PULL = 0.72, 1.19  # of the swarm: Clerc and Kennedy, IEEE Trans. Evol. Comp. 6(1), 2002


@dataclass(frozen=True)
class Layout:
    """
    Sensors on the arrays and what they are worth.

    Attributes
    ----------
    method : str
        How it was found.
    places : tuple of (str, float, float)
        Array, along_m and lateral_m of every sensor.
    score : float
        Mean log precision of the frequencies [1].
    gain : float
        Spread of the frequencies with the present sensors over that with this layout,
        geometric mean over the modes [1]; the same spread takes gain^2 less record.

    """

    method: str
    places: tuple
    score: float
    gain: float


class Scene:
    """What stays the same while sensors move: modes, excitation, noise, modes of interest."""

    def __init__(self, spacecraft, system, modes=None):
        self.spacecraft = spacecraft
        self.view = modal_view(system)
        driven = np.linalg.norm(self.view.drive, axis=1)
        excited = np.flatnonzero(driven > 1e-9 * driven.max())
        self.modes = excited if modes is None else np.asarray(modes)
        if self.modes.max() >= len(driven):
            raise ValueError(f'mode {self.modes.max() + 1} is beyond the {len(driven)} modes of '
                             'the model; keep more modes or ask for a lower one')
        lost = sorted(set(self.modes.tolist()) - set(excited.tolist()))
        if lost:
            raise ValueError(f'modes {[i + 1 for i in lost]} are not excited, so no sensor can '
                             'find them; leave them out or add excitation')
        self.noise = spacecraft.noise_rms_m_s2

    def rows(self, places):
        """Return the displacement rows of places, shape (k, dofs)."""
        return np.array([displacement_row(self.spacecraft, *p) for p in places])

    def score(self, places):
        """Return the mean log precision of the frequencies of interest."""
        info = information(self.view, self.rows(places), np.full(len(places), self.noise),
                           self.modes, points=9)
        spread, _ = spreads(info, len(self.modes))
        return float(np.mean(np.log(np.maximum(1.0 / spread, LEAST_PRECISION))))


def present(scene):
    """Return the layout of the sensors that the spacecraft has."""
    places = tuple((s.array, s.along_m, s.lateral_m) for s in scene.spacecraft.sensors)
    return Layout('present', places, scene.score(places), 1.0)


def effective_independence(scene, count, grid=(8, 5)):
    """
    Place sensors by effective independence, eq. (36).

    Parameters
    ----------
    scene : Scene
        Spacecraft, excitation and modes of interest.
    count : int
        Number of sensors.
    grid : tuple of two int
        Candidates along and across each array.

    Returns
    -------
    Layout

    """
    _check_count(count, 2 * grid[0] * grid[1])
    places = []
    for a in scene.spacecraft.arrays:
        along = np.linspace(0.0, a.plate.length_m, grid[0] + 1)[1:]
        lateral = np.linspace(-a.plate.width_m / 2, a.plate.width_m / 2, grid[1])
        places += [(a.name, float(s), float(x)) for s in along for x in lateral]
    rows = scene.rows(places)
    # Shapes in units of the noise; the unit matrix is the prior that lets count < modes.
    shapes = rows @ scene.view.motion[:, scene.modes]
    poles = np.exp(scene.view.eigenvalues[scene.modes] / scene.view.rate_hz)
    drive = np.linalg.norm(scene.view.drive[scene.modes], axis=1)
    shapes = shapes * drive / np.sqrt(1 - np.abs(poles) ** 2) / max(scene.noise, 1e-12)
    kept = list(range(len(places)))
    while len(kept) > count:
        own = shapes[kept]
        inside = np.linalg.inv(np.eye(len(scene.modes)) + (own.conj().T @ own).real)
        worth = np.einsum('ki,ij,kj->k', own.conj(), inside, own).real
        del kept[int(np.argmin(worth))]
    return _layout(scene, 'effective independence', [places[i] for i in kept])


def particle_swarm(scene, count, seed=1, particles=24, rounds=40, start=(), progress=None):
    """
    Place sensors by particle swarm optimisation.

    Parameters
    ----------
    scene : Scene
        Spacecraft, excitation and modes of interest.
    count : int
        Number of sensors.
    seed : int
        Seed of the swarm.
    particles, rounds : int
        Size of the swarm and how often it moves.
    start : sequence of Layout
        Layouts that some particles begin at.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Layout
        Never worse than the best of `start` with as many sensors.

    """
    _check_count(count, 64)
    if particles < 2 or rounds < 1:
        raise ValueError(f'particles={particles} and rounds={rounds} must be at least 2 and 1')
    rng = np.random.default_rng(seed)
    # A particle is (u, v) a sensor in the unit square: u runs over all arrays, one after another.
    at = rng.random((particles, count, 2))
    start = [s for s in start if len(s.places) == count][:particles]
    for i, layout in enumerate(start):
        at[i] = [_to_unit(scene.spacecraft, p) for p in layout.places]
    speed = 0.1 * rng.standard_normal(at.shape)
    best, value = at.copy(), np.full(particles, -np.inf)
    for turn in range(rounds):
        for i in range(particles):
            score = scene.score([_to_place(scene.spacecraft, p) for p in at[i]])
            if score > value[i]:
                best[i], value[i] = at[i], score
        leader = best[np.argmax(value)]
        own, social = rng.random((2, *at.shape))
        speed = INERTIA * speed + PULL * (own * (best - at) + social * (leader - at))
        at = np.clip(at + speed, 0.0, 1.0 - 1e-12)
        if progress is not None:
            progress((turn + 1) / rounds)
    leader = best[np.argmax(value)]
    return _layout(scene, 'particle swarm', [_to_place(scene.spacecraft, p) for p in leader])


def _layout(scene, method, places):
    places = tuple(sorted(places))
    score = scene.score(places)
    return Layout(method, places, score, float(np.exp(score - present(scene).score)))


def _to_place(spacecraft, point):
    u = point[0] * len(spacecraft.arrays)
    array = spacecraft.arrays[int(u)]
    return (array.name, float((u - int(u)) * array.plate.length_m),
            float((point[1] - 0.5) * array.plate.width_m))


def _to_unit(spacecraft, place):
    index = [a.name for a in spacecraft.arrays].index(place[0])
    plate = spacecraft.arrays[index].plate
    return ((index + min(place[1] / plate.length_m, 1 - 1e-9)) / len(spacecraft.arrays),
            place[2] / plate.width_m + 0.5)


def _check_count(count, most):
    if not 1 <= count <= most:
        raise ValueError(f'count={count} must be 1 to {most} sensors')
