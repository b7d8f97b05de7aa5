"""
Errors of a model that keep the modes where a record has them, beside an effect that moves them.

A model whose errors were fitted to the record itself has the frequencies of the record. An effect
that moves them is then beside its own consequence: what it changes, the errors have taken up
already. So a candidate stands at errors with what it moves taken back, and it is the prior that
says which of the two is more probable: an effect that explains large errors makes them small.
"""
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.gap.candidate import Candidate
from ssi_ros.model.errors import DAMPING, FREQUENCY, moved_matrices, places_of, stiffened
from ssi_ros.model.modal_errors import basis_of, modes_at, turned
from ssi_ros.model.structure import clamped_modes
from ssi_ros.scipy_later import linear_sum_assignment

ROUNDS = 15             # of Newton, at most
DONE = 2e-6             # change of a relative error at which it ends
NEAR = {FREQUENCY: 3e-5, DAMPING: 0.03}     # relative, what a mode is brought to
NEAR_SHAPE = 0.01       # of a shape, the same
HALVINGS = 5            # of a step, until it gains
FAR = {FREQUENCY: 0.3, DAMPING: 2.0}        # longest shift
LEAST = 1e-9            # share of a mode in a freedom that counts, squared
SHAPE_WEIGHT = 0.05     # logarithm of frequencies that one less the MAC is worth in a pairing
STILL = 1e-7            # relative change of a frequency or a damping that is none


class Compensation:
    """
    Shifts of errors, in their units, that take back what a candidate moves.

    The modes that the record has are those of the simulator with the effects `around`.
    """

    def __init__(self, simulator, names, stds, around=Candidate()):
        self.simulator, self.names, self.stds = simulator, names, stds
        self.values = np.array(simulator.spacecraft.calibration.values)
        model = simulator.spacecraft
        # the modes of somebody else's model are no freedoms of it
        self.shapes = None if model.arrays else basis_of(model)[0]
        self.nominal = self._of_modes(simulator.setup(Candidate()))
        self.home = Matrices.of(linearise(simulator.setup(around))).modes
        self._known = {around: np.zeros(len(names))}
        kinds, system = (FREQUENCY, DAMPING), self.nominal.system
        if self.shapes is not None:
            where = modes_at(names, model)
            self.index = {kind: where[kind] for kind in kinds}
            return
        where = places_of(names, system.dofs, system.channels, system.inputs)
        self.index = {kind: dict(zip(where[kind][1].tolist(), where[kind][0].tolist()))
                      for kind in kinds}

    def _of_modes(self, setup):
        """Return a setup whose freedoms are modes, as those of a spacecraft's arrays are."""
        return setup if self.shapes is None else turned(setup, self.shapes)

    def shift(self, candidate):
        """Return the shift of all errors for a candidate, (m,)."""
        if candidate not in self._known:
            self._known[candidate] = self._shift(candidate)
        return self._known[candidate]

    def _shift(self, candidate):
        shift = np.zeros(len(self.names))
        setup = self._of_modes(linearise(self.simulator.setup(candidate)))
        here = Matrices.of(setup)
        found = here.modes
        pairs = _paired(self.home, found)
        if all(np.allclose(found[k][pairs[1]], self.home[k][pairs[0]], rtol=STILL, atol=0)
               for k in (0, 1)):
            return shift
        dofs = list(self.nominal.system.dofs)
        at = setup.system.dofs
        own = [at.index(d) if d in at else None for d in dofs]
        here = here._replace(clamped=self._clamped(setup, here, own))
        distance = self._distance(found, shift)
        for _ in range(ROUNDS):
            there = self._step(here, own, shift)
            for _ in range(HALVINGS):
                after = self._distance(self._moved(here, own, there).modes, there)
                if after < distance:
                    break
                # errors of two alike arrays turn the shapes of a close pair before they part it
                there = (shift + there) / 2
            else:
                break
            moved, shift, distance = np.abs(there - shift).max(), there, after
            if moved < DONE:
                break
        return shift

    def _clamped(self, setup, here, own):
        """Return stiffness (n,) and shares (n, n) of the modes that errors are of, or None."""
        model = setup.spacecraft
        found = clamped_modes(model.arrays, model.sensors) if model.arrays else None
        if found is None:       # the freedoms are these modes
            return None
        squares, shares = np.diag(here.stiffness).copy(), np.eye(len(here.stiffness))
        n = len(found.squares)
        squares[3:n], shares[:n, :n] = found.squares[3:], found.shares
        for dof, i in self.index[FREQUENCY].items():
            squares[own[dof]] *= (1.0 + self.values[i]) ** 2
        return squares, shares

    def _distance(self, found, shift):
        """Return how far modes are from where the record has them, and errors from the prior."""
        home, there = _paired(self.home, found)
        log = [np.log(self.home[k][home] / found[k][there]) for k in (0, 1)]
        return float(np.sum((log[0] / NEAR[FREQUENCY]) ** 2)
                     + np.sum((log[1] / NEAR[DAMPING]) ** 2)
                     + np.sum(1 - _mac(self.home, found)[home, there]) / NEAR_SHAPE ** 2
                     + np.sum((shift / self.stds) ** 2))

    def _step(self, here, own, shift):
        """Return the shift that Gauss-Newton takes next, frequencies first, then dampings."""
        shift = shift.copy()
        for kind, numbers in self.index.items():
            moved = self._moved(here, own, shift)
            now = frequency, damping, shapes, _ = moved.modes
            pairs = _paired(self.home, now)         # anew: shapes of a close pair turn
            there = frequency if kind == FREQUENCY else damping
            wanted = np.log(self.home[0 if kind == FREQUENCY else 1][pairs[0]]
                            / there[pairs[1]])
            matrix = moved.stiffness if kind == FREQUENCY else moved.damping
            shapes = shapes[:, pairs[1]]
            energy = np.sum(shapes * (matrix @ shapes), axis=0)
            at = [(own[d], i) for d, i in numbers.items() if own[d] is not None]
            if not at:          # no error of this kind is declared
                continue
            dofs, which = np.array(at).T
            if kind == FREQUENCY and here.clamped:
                squares, shares = here.clamped
                slope = ((shares @ shapes)[dofs].T ** 2 * squares[dofs]) / energy[:, None]
            else:
                slope = (shapes[dofs].T ** 2 * matrix[dofs, dofs]) / energy[:, None]
            # the most probable errors of all that do it, as nearly as a record could show
            unit = shift[which] / self.stds[which]
            scaled = slope * self.stds[which] / NEAR[kind]
            unit = np.linalg.solve(
                scaled.T @ scaled + np.eye(len(unit)),
                scaled.T @ (wanted / NEAR[kind] + scaled @ unit))
            shift[which] = np.clip(self.stds[which] * unit, -FAR[kind], FAR[kind])
        return shift

    def _moved(self, here, own, shift):
        """Return Matrices with shifts of frequencies and dampings in them."""
        frequency, damping = np.ones(len(here.mass)), np.zeros(len(here.mass))
        for kind, out in ((FREQUENCY, frequency), (DAMPING, damping)):
            for dof, i in self.index[kind].items():
                if own[dof] is not None:
                    # relative errors are of the model as it is written, not as it stands
                    out[own[dof]] += shift[i] / (
                        1.0 + self.values[i] if kind == FREQUENCY else 1.0)
        stiffness, damping = moved_matrices(here.stiffness, here.damping, frequency, damping)
        if here.clamped:
            stiffness = here.stiffness + stiffened(*here.clamped, frequency)
        return here._replace(stiffness=stiffness, damping=damping)


class Matrices(NamedTuple):
    """What modes are computed of, without the checks that a System makes of each."""

    mass: np.ndarray        # (n, n)
    stiffness: np.ndarray   # (n, n)
    damping: np.ndarray     # (n, n)
    sensor: np.ndarray      # (l, n)
    stretch: float          # of frequencies, as the stamps have them
    clamped: tuple = None   # of hinged arrays: stiffness and shares of the modes of the clamped

    @classmethod
    def of(cls, setup):
        """Return those of a setup."""
        system = setup.system
        return cls(system.mass, system.stiffness, system.damping, system.sensor,
                   setup.stamp_rate_hz / system.rate_hz)

    @property
    def modes(self):
        """Return frequencies (k,), modal damping rates (k,), shapes (n, k), at channels (l, k)."""
        values, shapes = eigh(self.stiffness, self.mass, check_finite=False)
        keep = values > LEAST * values[-1]
        values, shapes = values[keep], shapes[:, keep]
        damping = np.sum(shapes * ((self.damping + self.damping.T) / 2 @ shapes), axis=0)
        return (np.sqrt(values) * self.stretch, np.maximum(damping, 1e-12) * self.stretch, shapes,
                self.sensor @ shapes)


def _paired(home, found):
    """Return the indices of modes that belong together, by frequency and shape."""
    distance = np.abs(np.log(home[0][:, None] / found[0][None]))
    return linear_sum_assignment(distance + SHAPE_WEIGHT * (1 - _mac(home, found)))


def _mac(home, found):
    """Return the MAC of all modes with all modes at the channels."""
    one, other = (s / np.maximum(np.linalg.norm(s, axis=0), 1e-300) for s in (home[3], found[3]))
    return (one.T @ other) ** 2
