"""
The most probable errors of a model beside a record: eq. (117) with the spectrum that they give.

The spectrum with errors is L R R^H L^H with R = 1 + K, K lower triangular and K + K^H = V, the
sum of the directions: a spectrum at any errors, and exact for gains. Its likelihood, not what a
quadratic promises, is what counts: far from the record no errors reach that, and its slopes lead
a fit astray.
"""
from typing import NamedTuple

from numba import njit
import numpy as np

from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.hermitian import hermitian

STEPS, ENOUGH = 30, 1e-3    # at most, and the promised gain of the log likelihood at the last
LONGEST = 2.0               # step, where the likelihood hardly bends
LEAST = 1e-2                # of the diagonal of R
HALVINGS = 6                # of a step that leads to no spectrum, or to a lower likelihood


class ErrorLikelihood:
    """
    The log likelihood of errors over that of none, their prior included, and its slopes.

    Parameters
    ----------
    merged : MergedBins
        Directions of the errors, and the bins that count as one.
    offset : ndarray, shape (n,)
        Where the model stands, from the mean of the prior.
    whitened : Whitened
        The record by the model without errors, heights taken out.

    """

    def __init__(self, merged, offset, whitened):
        count = whitened.lower.shape[-1]
        self.merged, self.offset, self.weight = merged, offset, whitened.weight
        self.many = len(whitened.excess) * merged.counts.astype(float)
        record = merged.sums(whitened.excess.sum(axis=0).reshape(-1, count * count))
        self.record = hermitian(record.reshape(-1, count, count))
        self.record += self.many[:, None, None] * np.eye(count)

    def change(self, errors):
        """Return V as real sums, (k, l, l)."""
        return self.merged.change(errors).reshape(self.record.shape)

    def at(self, errors, change=None):
        """Return the _Place of errors, of this V, or None where R has no positive diagonal."""
        change = self.change(errors) if change is None else change
        root, record = np.zeros_like(self.record), np.empty_like(self.record)
        slopes = np.empty(self.record.shape)
        value = _seen(change, self.record, self.many, root, record, slopes)
        if not np.isfinite(value):
            return None
        moved = errors + self.offset
        value = self.weight * value - float(
            moved @ moved - np.sum(np.square(self.offset))) / 2
        return _Place(errors, change, value,
                      self.weight * self.merged.slopes(slopes.ravel()) - moved, root, record)

    def curvature(self, place, step, change):
        """Return minus the second derivative of the likelihood along a step, (n,), of this V."""
        return self.weight * _bent(change, place.root, place.record, self.many) + step @ step


class _Place(NamedTuple):
    """Errors, their likelihood over that of none, and its slopes."""

    errors: np.ndarray      # (n,)
    change: np.ndarray      # (k, l, l), V as real sums
    value: float
    slopes: np.ndarray      # (n,)
    root: np.ndarray        # (k, l, l), R^-1
    record: np.ndarray      # (k, l, l), the sum of the record, whitened by L R


def most_probable(likelihood, information, free, start=None):
    """
    Return the value over that of no errors, and the most probable errors, (n,).

    By conjugate gradients, in the metric of the expected information, to the nearest maximum.

    Parameters
    ----------
    likelihood : ErrorLikelihood
        Of what is unknown.
    information : ndarray, shape (n, n)
        Expected at no errors, the prior's included: the metric of the steps.
    free : ndarray of bool, shape (n,)
        Which are fitted; the others stay 0.
    start : ndarray, shape (n,)
        Errors near by; none if left out.

    """
    most = LIMITS.corrected_std.value
    here = likelihood.at(np.zeros(len(free)))
    if start is not None:
        there = likelihood.at(np.where(free, start, 0.0))
        here = there if there and there.value > here.value else here
    along, before, moving = None, None, None
    for _ in range(STEPS):
        # an error at its limit stays there as long as the record pulls it outwards
        now = free & ((np.abs(here.errors) < most) | (here.slopes * here.errors < 0.0))
        steepest = np.zeros(len(free))
        steepest[now] = np.linalg.solve(information[np.ix_(now, now)], here.slopes[now])
        if here.slopes @ steepest / 2 < ENOUGH:
            break
        step = steepest
        if along is not None and np.array_equal(now, moving):
            share = max(0.0, (here.slopes - before[1]) @ steepest / (before[1] @ before[0]))
            step = steepest + share * along
            step = step if here.slopes @ step > 0.0 else steepest
        along, before, moving = step, (steepest, here.slopes), now
        turned = likelihood.change(step)
        slope, curved = here.slopes @ step, likelihood.curvature(here, step, turned)
        far = slope / curved if curved > slope / LONGEST else LONGEST
        for _ in range(HALVINGS):
            errors = here.errors + far * step
            inside = np.abs(errors).max() <= most
            there = likelihood.at(*((errors, here.change + far * turned) if inside
                                    else (np.clip(errors, -most, most),)))
            if there and there.value > here.value:
                break
            far = far / 2
        else:
            break
        here = there
    return here.value, here.errors


def factors(change):
    """Return the lower factors R, (k, l, l), of changes V, Hermitian, (k, l, l)."""
    diagonal = np.einsum('kii->ki', change).real
    return np.tril(change, -1) + np.eye(change.shape[-1]) * (1 + diagonal / 2)[:, None, :]


@njit(cache=True, error_model='numpy')
def _inverse_factor(change, root):
    """Write R^-1 of V as real sums, (l, l); False where R has no positive diagonal."""
    count = len(change)
    for j in range(count):
        diagonal = 1.0 + change[j, j] / 2
        if not diagonal > LEAST:
            return False
        root[j, j] = 1.0 / diagonal
        for i in range(j + 1, count):
            total = 0.0 + 0.0j
            for m in range(j, i):
                total += complex(change[i, m] + change[m, i],
                                 change[i, m] - change[m, i]) / 2 * root[m, j]
            root[i, j] = -total / (1.0 + change[i, i] / 2)
    return True


@njit(cache=True, error_model='numpy')
def _seen(change, record, many, root, white, slopes):
    """Fill Q = R^-1, X = Q T Q^H and, as real sums, the slopes; return the likelihood or -inf."""
    bins, count = change.shape[:2]
    half, value = np.empty((count, count), record.dtype), 0.0
    for k in range(bins):
        if not _inverse_factor(change[k], root[k]):
            return -np.inf
        for j in range(count):
            value += record[k, j, j].real - 2 * many[k] * np.log(1.0 + change[k, j, j] / 2)
        for i in range(count):
            for j in range(count):
                total = root[k, i, 0] * record[k, 0, j]
                for m in range(1, i + 1):
                    total += root[k, i, m] * record[k, m, j]
                half[i, j] = total
        for i in range(count):
            for j in range(count):
                total = half[i, 0] * root[k, j, 0].conjugate()
                for m in range(1, j + 1):
                    total += half[i, m] * root[k, j, m].conjugate()
                white[k, i, j] = total
            value -= white[k, i, i].real
        # 2 Re tr(K (X - many) Q): only the upper triangle of the product meets K
        for i in range(count):
            for j in range(i, count):
                total = -many[k] * root[k, i, j]
                for m in range(j, count):
                    total += white[k, i, m] * root[k, m, j]
                if i == j:
                    slopes[k, i, i] = total.real
                else:
                    slopes[k, i, j] = total.real + total.imag
                    slopes[k, j, i] = total.real - total.imag
    return value


@njit(cache=True, error_model='numpy')
def _bent(change, root, white, many):
    """Return the sum over bins of 2 (2 Re tr(q q X) + tr(q X q^H) - many Re tr(q q)), q = Q K."""
    bins, count = change.shape[:2]
    left, total = np.zeros((count, count), root.dtype), 0.0
    for k in range(bins):
        for i in range(count):
            for j in range(i + 1):
                one = root[k, i, j] * change[k, j, j] / 2
                for m in range(j + 1, i + 1):
                    one += root[k, i, m] * complex(change[k, m, j] + change[k, j, m],
                                                   change[k, m, j] - change[k, j, m]) / 2
                left[i, j] = one
        for i in range(count):
            total -= 2 * many[k] * (left[i, i] * left[i, i]).real
            for j in range(count):
                seen = 0.0 + 0.0j                   # (q X)_ij
                for m in range(i + 1):
                    seen += left[i, m] * white[k, m, j]
                if j >= i:
                    total += 4 * (seen * left[j, i]).real
                if j <= i:
                    total += 2 * (seen * left[i, j].conjugate()).real
    return total


@njit(cache=True, error_model='numpy')
def seen(change, excess, out):
    """
    Write the excess whose product with a direction is the slope along it, `ModelUncertainty.seen`.

    Parameters
    ----------
    change : ndarray, shape (k, l, l)
        V of the errors, as real sums.
    excess, out : ndarray, shape (a, k, l, l)
        Of the record before and after, as real sums.

    """
    parts, bins, count = excess.shape[:3]
    inverse = np.zeros((count, count), np.complex128)
    inner, record = np.empty_like(inverse), np.empty_like(inverse)
    for k in range(bins):
        _inverse_factor(change[k], inverse)     # of errors that a fit has stood at
        for i in range(count):
            for j in range(i, count):               # R^-H R^-1
                total = 0.0 + 0.0j
                for m in range(j, count):
                    total += inverse[m, i].conjugate() * inverse[m, j]
                inner[i, j], inner[j, i] = total, total.conjugate()
        for a in range(parts):
            for i in range(count):
                for j in range(count):
                    up, down = excess[a, k, i, j], excess[a, k, j, i]
                    record[i, j] = complex(up + down, up - down) / 2
                record[i, i] += 1.0
            for i in range(count):
                for j in range(i, count):
                    total = 0.0 + 0.0j
                    for m in range(count):
                        total += record[i, m] * inner[m, j]
                    if i == j:
                        out[a, k, i, i] = total.real - 1.0
                    else:
                        out[a, k, i, j] = total.real + total.imag
                        out[a, k, j, i] = total.real - total.imag
