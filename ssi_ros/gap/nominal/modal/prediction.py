"""What the spectrum of a reference becomes with effects: their filters in turn, eq. (145)."""
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.nominal.forms.candidate import slices_of
from ssi_ros.hermitian import filtered, is_definite


@dataclass(frozen=True, eq=False)
class Averages:
    """A mean spectrum (b, l, l) that a fit is made to, and the independent spectra in a band."""

    mean: np.ndarray
    n_one: float            # of the reference
    n_two: float            # of the record

    @property
    def weight(self):
        """Independent spectra that a difference of the two means counts for."""
        return self.n_one * self.n_two / (self.n_one + self.n_two)


@dataclass(frozen=True, eq=False)
class Prediction:
    """What the spectrum of a reference becomes."""

    mean: np.ndarray        # (b, l, l), S' of eq. (145)
    scatters: np.ndarray    # (b, l, l), part that scatters as the reference; the rest is smooth
    gain: np.ndarray = None         # (b, l, l), of all filters of the forms, None without any

    def freedom(self, n_one):
        """Return the effective number of independent spectra behind it, shape (b,), eq. (150)."""
        # the share in all directions, tr S'^-1 F / l
        share = np.einsum('bii->b', np.linalg.solve(self.mean, self.scatters)).real
        width = self.mean.shape[-1]
        least = min(n_one, width + 1.0)         # fewer have no determinant
        low, high = LIMITS.least_scatter.value, LIMITS.most_scatter.value
        return np.maximum(n_one / np.clip(share / width, low, high) ** 2, least)

    @cached_property
    def possible(self):
        """Whether it is a spectrum: positive definite in every band."""
        return is_definite(self.mean)

    def turned(self, turn):
        """Return what a filter (b, l, l), or None, makes of it."""
        return Prediction(filtered(turn, self.mean), filtered(turn, self.scatters))


def predict(nominal, forms, x):
    """Return what the spectrum of a reference becomes, eq. (145), a Prediction."""
    return filtered_by(nominal, forms, changes_of(nominal, forms, x), x)


def changes_of(nominal, forms, x):
    """Return the filter and the added power of every form at its numbers, (b, l, l) or None."""
    return [form.change(nominal, x[2:][at]) for form, at in zip(forms, slices_of(forms))]


def filtered_by(nominal, forms, changes, x, bands=slice(None)):
    """Return the Prediction of known changes, in all bands or in some."""
    noise, total = np.diag(nominal.floor), None
    # filters act on all that scatters; the noise that they must not change is put back
    spectrum, still = nominal.spectrum[bands], noise
    fixed = np.zeros_like(spectrum)
    for form, (gain, added) in zip(forms, changes):
        gain = gain if gain is None else gain[..., bands, :, :]
        spectrum = filtered(gain, spectrum)
        if gain is not None and gain.ndim < 4:      # the mean of many is no filter
            total = gain if total is None else gain @ total
        still = still if form.on_samples else filtered(gain, still)
        if added is not None:
            fixed = fixed + added[bands]
    level = np.exp(x[0])
    return Prediction(level * (spectrum + fixed + noise - still) + x[1] * noise, level * spectrum,
                      total)


def bands_between(one, two):
    """Return the bands in which two changes of one form differ, (c,)."""
    differs = False
    for a, b in zip(one, two):
        if a is None and b is None:
            continue
        if a is None or b is None:
            return slice(None)
        apart = np.any(a != b, axis=(-2, -1))
        differs = differs | (apart.any(axis=0) if apart.ndim > 1 else apart)
    return np.flatnonzero(differs)
