"""Spectra of a record, of a model and of a model with an effect, and how they differ."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.spectra.segmentation import spectra

STEPS = 40              # of the levels; each gains, the last ones nothing


@dataclass(frozen=True, eq=False)
class Curves:
    """
    What is drawn of one model beside a record.

    Attributes
    ----------
    expected : ndarray, shape (k, l, l)
        Expected periodograms at the fitted levels, the mean over the segments.
    levels : dict of str to float
        Fitted power of each part of the excitation and of the noise over its nominal one.
    whitened : ndarray, shape (p, k)
        Power of every segment and bin over what the model expects, the mean of the channels;
        1 where the model is right.
    own : ndarray, shape (k, l)
        The same for each channel alone, the mean of the segments.

    """

    expected: np.ndarray
    levels: dict
    whitened: np.ndarray
    own: np.ndarray


def record_periodograms(samples, frame):
    """Return Y Y^H of every segment, shape (p, k, l, l), and its spectra Y, shape (p, k, l)."""
    y = spectra(samples, frame)
    return y[..., :, None] * y[..., None, :].conj(), y


def curves(expected, samples, frame):
    """
    Compare a model with a record, the levels of its excitation and noise fitted.

    Parameters
    ----------
    expected : Expected
        Of `gap.spectra.expected_periodogram`.
    samples : Samples
        The record.
    frame : Frame
        How it is cut.

    Returns
    -------
    Curves

    """
    periodograms, y = record_periodograms(samples, frame)
    mean = periodograms.mean(axis=0)
    shares = [np.broadcast_to(s.mean(axis=0), mean.shape) for s in expected.shares]
    fixed = expected.fixed.mean(axis=0)
    levels = np.ones(len(shares))
    for _ in range(STEPS):
        model = fixed + sum(a * s for a, s in zip(levels, shares))
        inverse = np.linalg.inv(model)
        weighed = inverse @ mean @ inverse
        # Whittle's equations for a level, as a ratio that keeps it positive
        want = [np.einsum('kij,kji->', weighed, s).real for s in shares]
        have = [np.einsum('kij,kji->', inverse, s).real for s in shares]
        levels = levels * np.sqrt(np.array(want) / np.array(have))
    model = fixed + sum(a * s for a, s in zip(levels, shares))
    white = np.einsum('pki,kij,pkj->pk', y.conj(), np.linalg.inv(model), y).real / y.shape[-1]
    own = np.einsum('kii->ki', mean).real / np.einsum('kii->ki', model).real
    return Curves(model, dict(zip(expected.names, map(float, levels))), white, own)


def density(periodograms, rate_hz):
    """Return one-sided amplitude densities [(m/s^2)/Hz^0.5] of periodograms (k, l, l), (k, l)."""
    return np.sqrt(2.0 * np.einsum('kii->ki', periodograms).real / rate_hz)


def banded(values, count, axis):
    """Return means over about `count` bands of bins along an axis."""
    parts = np.array_split(values, count, axis=axis)
    return np.stack([p.mean(axis=axis) for p in parts], axis=axis)
