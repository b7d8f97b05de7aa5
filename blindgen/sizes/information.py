# Licensed under the Apache License, Version 2.0.
"""
What a record can tell about an effect beyond all that a diagnosis may not know.

A change dS of the spectrum S is a vector u = L^-1 dS L^-H over all bins, S = L L^H, whose square
is d'^2 of a test that knows all else; the unknowns are vectors V. Their information before the
record is G0: their spreads, and what the healthy recordings gave. Then

    d'^2 = u (I + V' G0^-1 V)^-1 u = |u|^2 - (V u)' (V V' + G0)^-1 (V u).
"""
from dataclasses import dataclass
from functools import cached_property

from blindgen.physics.propagate import modes_of
from blindgen.physics.sensors import missing
from blindgen.physics.spectrum import spectrum
from blindgen.sizes.unknowns import moved, spreads, unknowns
import numpy as np
from scipy.linalg import cho_factor, cho_solve

STEPS = 6                   # of the fit of the unknowns, at most
FIRST_BIN, LAST = 2.0, 0.49        # of the record, in bins; of the rate
TAPERED = 0.973             # of the bins are worth having once 5 % of a record are faded
BACKGROUND, REACH, PER_MODE = 700, 60.0, 17


def grid(scenario, duration_s):
    """
    Return frequencies f (n,) [Hz], dense at the modes, and the record's bins that each stands for.

    Missing samples take their share of the bins, and so does the fading of a record's ends.
    """
    rate = scenario.craft.rate_hz
    low, high = FIRST_BIN / duration_s, LAST * rate
    hz, damping = modes_of(scenario)
    x = np.geomspace(0.15, REACH, PER_MODE)
    x = np.concatenate([-x[::-1], [0.0], x])
    f = np.concatenate([np.geomspace(low, high, BACKGROUND),
                        np.linspace(low, high, BACKGROUND // 4),
                        (hz[:, None] * (1 + damping[:, None] * x)).ravel()])
    f = np.unique(np.clip(f, low, high))
    f = f[np.concatenate([[True], np.diff(f) > 1e-7 * high])]
    edges = np.concatenate([[low], (f[1:] + f[:-1]) / 2, [high]])
    kept = TAPERED * (1 - np.mean(missing(scenario, 4000)))
    return f, np.diff(edges) * duration_s * kept


def vectors(changes, root, bins):
    """Return changes (n, c, c) of a spectrum, L^-1 given as root, as a real vector (n c^2,)."""
    white = root @ changes @ np.conj(np.swapaxes(root, -1, -2))
    return flat(white, bins)


def flat(white, bins):
    """Return Hermitian matrices (n, c, c) as a vector whose inner product is sum tr(A B)."""
    upper = np.triu_indices(white.shape[-1], 1)
    parts = [np.einsum('kii->ki', white).real, np.sqrt(2) * white[:, upper[0], upper[1]].real,
             np.sqrt(2) * white[:, upper[0], upper[1]].imag]
    return (np.concatenate(parts, axis=1) * np.sqrt(bins)[:, None]).ravel()


def derivatives(scenario, f, bins, root, share):
    """Return V (p, n c^2): what each unknown does to the spectrum."""
    data = []
    for unknown in unknowns(scenario):
        ends = [sum(spectrum(unknown.moved(scenario, h), f, share))
                for h in (-unknown.step, unknown.step)]
        data.append(vectors((ends[1] - ends[0]) / (2 * unknown.step), root, bins))
    return np.array(data)


@dataclass(frozen=True)
class Record:
    """A scenario of a record, on its grid, and the vectors of its unknowns."""

    scenario: object
    duration_s: float

    @cached_property
    def grid(self):
        """Return f (n,) [Hz] and the bins (n,) that each stands for."""
        return grid(self.scenario, self.duration_s)

    @cached_property
    def share(self):
        """Return the part of all bins that each frequency stands for."""
        return self.grid[1] / self.grid[1].sum()

    @cached_property
    def spectrum(self):
        """Return S (n, c, c) with the noise."""
        return self.expected(self.scenario)

    @cached_property
    def root(self):
        """Return L^-1 (n, c, c)."""
        return np.linalg.inv(np.linalg.cholesky(self.spectrum))

    @cached_property
    def v(self):
        """Return the vectors of the unknowns (p, n c^2)."""
        return derivatives(self.scenario, *self.grid, self.root, self.share)

    @cached_property
    def fisher(self):
        """Return their information in this record (p, p)."""
        return self.v @ self.v.T

    def once(self, key, make):
        """Return make(), which depends on this record and the key alone, made the first time."""
        kept = self.__dict__.setdefault('kept', {})
        if key not in kept:
            kept[key] = make()
        return kept[key]

    def expected(self, scenario):
        """Return S (n, c, c) of another scenario on the grid of this record, with its noise."""
        return sum(spectrum(scenario, self.grid[0], self.share))

    def root_of(self, scenario):
        """Return L^-1 (n, c, c) of another scenario on the grid of this record."""
        return np.linalg.inv(np.linalg.cholesky(self.expected(scenario)))

    def change(self, scenario, test=False):
        """Return the vector u of the change to another scenario: `change_to` its spectrum."""
        return self.change_to(self.expected(scenario), test)

    def change_to(self, other, test=False, root=None):
        """
        Return the vector u of the change to a spectrum (n, c, c), whose square is d'^2.

        With the whitened change D, w = 2 D / (1 + (1 + D)^2) is the quadratic statistic with the
        largest ratio of its shift to its spread, of which half is without and half with the
        change; its squared ratio is |u|^2 of u = D sqrt(2 / (1 + (1 + D)^2)). For a small change
        both are D. `test` returns w. `root` is L^-1 of what is changed from, the record's own
        spectrum if left out.
        """
        root, bins = self.root if root is None else root, self.grid[1]
        white = root @ other @ np.conj(np.swapaxes(root, -1, -2))
        values, basis = np.linalg.eigh(white)
        half = 2 / (1 + np.maximum(values, 0.0)**2)
        values = (values - 1) * (half if test else np.sqrt(half))
        return flat((basis * values[:, None, :]) @ np.conj(np.swapaxes(basis, -1, -2)), bins)


class Knowledge:
    """What is known before a record: of its model, and by its healthy recordings."""

    def __init__(self, record, healthy=()):
        """
        Gather the information.

        Parameters
        ----------
        record : Record
            To be diagnosed.
        healthy : sequence of Record
            Of the same truth.

        """
        self.record, self.healthy = record, tuple(healthy)
        shared = np.array([u.shared for u in unknowns(record.scenario)])
        prior = np.diag(1 / spreads(record.scenario)**2)
        self.before = prior.copy()
        for each in healthy:
            f = each.fisher + prior * ~shared
            own = np.ix_(~shared, ~shared)
            cross = f[np.ix_(shared, ~shared)]
            self.before[np.ix_(shared, shared)] += (
                f[np.ix_(shared, shared)] - cross @ np.linalg.solve(f[own], cross.T))
        self.after = cho_factor(self.before + record.fisher)

    def distance(self, scenario):
        """
        Return d' of a record of another scenario, the unknowns fitted as well as they can.

        The least of |u|^2 and what the fit costs beforehand, by Gauss-Newton steps with the
        record's own derivatives, a step that does not help being halved; no more than by
        derivatives alone, as a test that linearises the unknowns sees it.
        """
        start, record = self.record.scenario, self.record
        other = record.expected(scenario)

        def cost(amounts):
            u = record.change_to(other, root=self.start if not amounts.any() else
                                 record.root_of(moved(start, amounts)))
            return u, u @ u + amounts @ self.before @ amounts

        at = np.zeros(len(self.before))
        u, best = cost(at)
        linear, step = self.inner(u, u), 1.0
        for _ in range(STEPS):
            ahead = at + step * cho_solve(self.after, record.v @ u - self.before @ at)
            new, value = cost(ahead)
            if value < best:
                gain, (at, u, best) = best - value, (ahead, new, value)
                if gain < 0.01 * best:
                    break
            else:
                step /= 2
        return float(np.sqrt(max(min(best, linear), 0.0)))

    @cached_property
    def start(self):
        """Return L^-1 (n, c, c) where the fit of the unknowns begins."""
        return self.record.root_of(moved(self.record.scenario, np.zeros(len(self.before))))

    def inner(self, a, b):
        """Return the inner product of two changes beyond what the unknowns explain."""
        v = self.record.v
        scores = v @ a
        return self._inner(a, b, scores, scores if b is a else v @ b)

    def _inner(self, a, b, scores_a, scores_b):
        return float(a @ b - scores_a @ cho_solve(self.after, scores_b))

    def size(self, u):
        """Return d' of a change u."""
        return float(np.sqrt(max(self.inner(u, u), 0.0)))

    def cosines_with(self, a):
        """
        Return the function that gives the cosine of a change with a, beyond the unknowns.

        The product with the unknowns' vectors, tens of megabytes, is all that a cosine takes: it
        is made once of each change.
        """
        v = self.record.v
        scores_a, size_a = v @ a, self.size(a)

        def cosine(b):
            scores_b = v @ b
            size_b = float(np.sqrt(max(self._inner(b, b, scores_b, scores_b), 0.0)))
            return self._inner(a, b, scores_a, scores_b) / max(size_a * size_b, 1e-12)
        return cosine

    def from_scores(self, shifts):
        """Return the change whose scores on the unknowns' vectors are given (p,)."""
        v, f = self.record.v, self.record.fisher
        return np.linalg.lstsq(f, shifts, rcond=1e-10)[0] @ v

    def seen(self, u):
        """Return what of a change the unknowns' vectors show, as of simulations."""
        return self.from_scores(self.record.v @ u)
