"""Fit forms of effects to two recordings, and try them on groups left out, eq. (151) to (153)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.reference.distance import divergence

STEPS = 12
ENOUGH = 1e-2           # gain of the likelihood below which a fit has arrived


@dataclass(frozen=True, eq=False)
class Fitted:
    """
    Forms at their best coordinates.

    Attributes
    ----------
    forms : tuple of Form
        What acts, one after the other.
    x : ndarray, shape (2 + p,)
        Logarithm of the level, change of all noise floors in floors, coordinates of the forms.
    covariance : ndarray, shape (2 + p, 2 + p)
        Inverse of the information.
    likelihood : float
        Logarithm, 0 where the spectra are equal.
    predicted : ndarray, shape (b, l, l)
        What the reference becomes.

    """

    forms: tuple
    x: np.ndarray
    covariance: np.ndarray
    likelihood: float
    predicted: np.ndarray

    def coordinates(self, index):
        """Return the slice of x that belongs to one of the forms."""
        first = 2 + sum(len(f.numbers) for f in self.forms[:index])
        return slice(first, first + len(self.forms[index].numbers))


def predict(nominal, forms, x):
    """Return what the spectrum of a reference becomes, eq. (145), shape (b, l, l)."""
    noise = np.diag(nominal.floor)
    spectrum, fixed, at = nominal.spectrum - noise, noise, 2
    for form in forms:
        spectrum, fixed = form.applied(nominal, spectrum, fixed, x[at:at + len(form.numbers)])
        at += len(form.numbers)
    return np.exp(x[0]) * (spectrum + fixed) + x[1] * noise


def log_likelihood(predicted, seen, n_one, n_two, trust=1.0):
    """Return the likelihood ratio of one common spectrum against two, eq. (151)."""
    if not np.all(np.linalg.eigvalsh(predicted)[:, 0] > 0):
        return -np.inf
    value = -np.sum(trust * divergence(predicted, seen, n_one, n_two))
    value *= n_one * n_two / (n_one + n_two)
    return float(value) if np.isfinite(value) else -np.inf


def whitener(pooled, trust):
    """Return L^-1 of pooled = L L^H, smaller where a band is trusted less, shape (b, l, l)."""
    return np.linalg.inv(np.linalg.cholesky(pooled)) * np.power(trust, 0.25)[:, None, None]


def whitened(matrices, lower):
    """Return L^-1 M L^-H as real vectors with the same inner product, (b l l,)."""
    turned = lower @ matrices @ lower.conj().swapaxes(-1, -2)
    # the sum of real and imaginary part keeps tr A B: the cross terms cancel by symmetry
    return (turned.real + turned.imag).reshape(-1)


def slopes(nominal, forms, x, predicted):
    """Yield the change of the prediction by each coordinate, by forward differences."""
    starts = [0.01, 0.05] + [n.start / 10 for f in forms for n in f.numbers]
    for j, step in enumerate(starts):
        moved = np.array(x)
        moved[j] += step
        yield (predict(nominal, forms, moved) - predicted) / step


def fit(nominal, seen, n_one, n_two, forms=(), start=None, steps=STEPS):
    """
    Maximise the likelihood by damped Fisher scoring, eq. (152).

    Parameters
    ----------
    nominal : Nominal
        The reference.
    seen : ndarray, shape (b, l, l)
        Mean spectrum of the record.
    n_one, n_two : float
        Independent spectra behind both.
    forms : tuple of Form
        What may act.
    start : ndarray, shape (2 + p,), optional
        Where to begin.
    steps : int
        At most.

    Returns
    -------
    Fitted

    """
    numbers = [n for f in forms for n in f.numbers]
    low = np.array([-12.0, -1e6] + [n.low for n in numbers])
    high = np.array([12.0, 1e6] + [n.high for n in numbers])
    if start is None:
        start = np.array([level_of(nominal.spectrum, seen), 0.0] + [n.start for n in numbers])
    x = np.array(start, float)
    predicted = predict(nominal, forms, x)
    trust = nominal.trust
    best = log_likelihood(predicted, seen, n_one, n_two, trust)
    if not np.isfinite(best):           # of other groups: more noise taken away than there is
        x[1:] = 0.0
        predicted = predict(nominal, forms, x)
        best = log_likelihood(predicted, seen, n_one, n_two, trust)
    damping, weight = 1e-3, n_one * n_two / (n_one + n_two)
    information = np.eye(len(x))
    for _ in range(steps):
        pooled = (n_one * predicted + n_two * seen) / (n_one + n_two)
        lower = whitener(pooled, trust)
        rows = np.array([whitened(s, lower) for s in slopes(nominal, forms, x, predicted)])
        information = weight * rows @ rows.T
        # of (151) itself, not of its limit for small differences
        back = lower.conj().swapaxes(-1, -2)
        root = np.sqrt(trust)[:, None, None]
        rest = root * (np.linalg.inv(lower @ predicted @ back / root) - np.eye(len(back[0])))
        gradient = n_one * rows @ (rest.real + rest.imag).reshape(-1)
        gained = 0.0
        scale = np.maximum(np.diag(information), 1e-12)
        for _ in range(8):
            move = np.linalg.solve(information + damping * np.diag(scale), gradient)
            there = np.clip(x + move, low, high)
            trial = predict(nominal, forms, there)
            value = log_likelihood(trial, seen, n_one, n_two, trust)
            if value > best:
                gained, x, predicted, best = value - best, there, trial, value
                damping = max(damping / 10, 1e-6)
                break
            damping *= 6
        if gained < ENOUGH:
            break
    scale = np.sqrt(np.maximum(np.diag(information), 1e-12))
    covariance = np.linalg.pinv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    return Fitted(tuple(forms), x, covariance, best, predicted)


def level_of(one, two):
    """Return the logarithm of the level of one spectrum over another: a median of the power."""
    before, after = (np.einsum('bii->bi', s).real for s in (one, two))
    # a channel with another gain shall not decide
    levels = []
    for a, b in zip(before.T, after.T):
        order = np.argsort(np.log(b / a))
        weight = np.cumsum((a / a.sum() + b / b.sum())[order])
        levels.append(np.log(b / a)[order][np.searchsorted(weight, 1.0)])
    return float(np.median(levels))
