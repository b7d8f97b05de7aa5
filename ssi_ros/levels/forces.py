"""
Spectra of the forces on the modes of a recording: what other levels of the inputs can change.

Whatever happens to the levels of any inputs, only F of eq. (150b) changes: frequencies, damping,
shapes and colour of `ModalModel` stay.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.hermitian import white_vectors
from ssi_ros.levels.modal_model import begun, bounded, lower_of, MISFIT, refined

STEPS = 3               # of the reweighted least squares
FREE_STD = 2.0          # of the change of an entry over its size: 6 dB is 3
MOST_CHANGE = 20.0      # power over that of the reference at one common level, or its inverse
MOST_ENTRIES = 3e7      # of all matrices together: 240 MB
LEAST_SHARE = 1e-6      # eigenvalue of correlated directions that counts as one of its own


@dataclass(frozen=True, eq=False)
class ForceSpectra:
    """A recording as modes under forces of one colour."""

    matrices: np.ndarray    # (p, b, l, l), complex64, change of S with an entry that levels change
    scales: np.ndarray      # (p,), sizes of the entries, sqrt(F_ii F_jj)
    mean: np.ndarray        # (b, l, l), S of the recording in this form

    def in_bands(self, kept):
        """Return the same in some of the bands, by an array of bool of shape (b,)."""
        return replace(self, matrices=self.matrices[:, kept], mean=self.mean[kept])

    def at_levels_of(self, spectrum, count, level, changed=lambda matrices: matrices):
        """
        Return the spectrum (b, l, l) of the same modes under the forces of another recording.

        `spectrum`, (b, l, l), is its mean of `count` independent spectra, `level` the power over
        that of this one which most bands have in common, about which the entries of F vary;
        `changed` is what else happened to spectra (p, b, l, l) of this one on the way to it.
        """
        usual, scales = level * self.mean, level * self.scales
        start, free = changed(usual[None])[0], changed(self.matrices)
        found = start
        for step in range(STEPS):
            lower = lower_of(found, spectrum, first=step == 0)
            rows = white_vectors(lower, free)
            rest = white_vectors(lower, (spectrum - start)[None])
            inner = count * (rows @ rows.T) * np.outer(scales, scales)
            inner += np.eye(len(rows)) / FREE_STD ** 2
            moved = scales * np.linalg.solve(inner, count * scales * (rows @ rest[0]))
            found = start + np.tensordot(moved, free, 1)
        return bounded(usual + np.tensordot(moved, self.matrices, 1), usual, 1 / MOST_CHANGE,
                       MOST_CHANGE)

    def basis(self, lower, changed=lambda matrices: matrices):
        """Return orthonormal rows, (k, b l l), of what levels change, whitened by (b, l, l)."""
        rows = white_vectors(lower, changed(self.matrices))
        rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
        values, vectors = np.linalg.eigh(rows @ rows.T)
        kept = values > LEAST_SHARE * len(rows)
        return (vectors[:, kept] / np.sqrt(values[kept])).T @ rows


def force_spectra(modes, frequencies_hz, spectrum, averages):
    """
    Fit the forces on the modes of a recording to its spectrum.

    Parameters
    ----------
    modes : sequence of Mode
        Frequencies [Hz], damping ratios [1] and shapes (l,), as identified.
    frequencies_hz : ndarray, shape (b, n)
        Points of each band of the spectrum, over which a band is a mean.
    spectrum : ndarray, shape (b, l, l)
        Mean spectral matrix of each band.
    averages : float
        Independent spectra in it.

    Returns
    -------
    ForceSpectra
        None without modes, or where all its matrices together are too large.

    """
    if not modes:
        return None
    start = begun(modes, frequencies_hz)
    if len(start.pairs) * spectrum.size > MOST_ENTRIES:
        return None
    model = refined(start, spectrum, averages)
    matrices, (first, second), noise = model.matrices, model.pairs.T, model.noise
    alone, own = first == second, np.zeros(len(model.directions))
    own[first[alone]] = np.abs(model.forces[alone])
    scales = np.sqrt(own[first] * own[second])
    # the constant of one channel alone may be its noise, which no input changes: what forces do
    # to all channels at once they do to all of them
    common = np.tensordot(scales[noise], matrices[noise], 1)[None]
    return ForceSpectra(np.concatenate([matrices[~noise], common]), np.append(scales[~noise], 1.0),
                        bounded(model.spectrum, spectrum, 1 / MISFIT, MISFIT))


def turning(before, after):
    """Return the filter (b, l, l), nearest to none, that turns one spectrum into another."""
    root = _power(before, 0.5)
    back = np.linalg.inv(root)
    return back @ _power(root @ after @ root, 0.5) @ back


def _power(matrices, exponent):
    values, vectors = np.linalg.eigh(matrices)
    values = np.maximum(values, 1e-300) ** exponent
    return (vectors * values[:, None, :]) @ vectors.conj().swapaxes(-1, -2)
