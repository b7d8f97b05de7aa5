"""
Spectra of the forces on identified modes: what other levels of the inputs can change.

    S(f) = sum_ij F_ij v_i(f) v_j(f)^H,   v_i = phi_i f^2 / (f_i^2 - f^2 + 2j xi_i f_i f)

F is real and symmetric for white forces (Brincker and Ventura, Introduction to Operational Modal
Analysis, 2015, ch. 7). Beside the modes every channel has a constant and a term in f^2, for forces
that reach it at once and for modes above the band. Whatever happens to the levels of any inputs,
only F changes: frequencies, damping and shapes stay.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.hermitian import inverse_root, white_vectors

NEXT, FAR = 3, 0.4       # modes to the next, or log frequency ratio, beyond which two are apart
STEPS = 3               # of the reweighted least squares
RIDGE = 1e-7            # of the information of each entry of F
FREE_STD = 2.0          # of the change of an entry over its size: 6 dB is 3
BOUNDED = 0.5, 1.5      # eigenvalues of a model over the mean of model and spectrum, in weights
MISFIT = 10.0           # eigenvalue of a model over the spectrum, or its inverse, at most
MOST_CHANGE = 20.0      # power over that of the reference at one common level, or its inverse
MOST_ENTRIES = 3e7      # of all matrices together: 240 MB
LEAST_SHARE = 1e-6      # eigenvalue of correlated directions that counts as one of its own


@dataclass(frozen=True, eq=False)
class ForceSpectra:
    """A recording as modes under white forces."""

    matrices: np.ndarray    # (p, b, l, l), complex64, change of S with an entry that levels change
    scales: np.ndarray      # (p,), sizes of the entries, sqrt(F_ii F_jj)
    mean: np.ndarray        # (b, l, l), S of the recording in this form

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
            lower = _lower(found, spectrum, first=step == 0)
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


def force_spectra(modes, frequencies_hz, spectrum):
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

    Returns
    -------
    ForceSpectra
        None without modes, or where all its matrices together are too large.

    """
    count, width = len(modes), spectrum.shape[1]
    size, logs = count + 2 * width, np.log([m.frequency_hz for m in modes])
    pairs = np.array([(i, j) for i in range(size) for j in range(i, size)
                      if j >= count or j - i <= NEXT or abs(logs[i] - logs[j]) < FAR])
    if not count or len(pairs) * spectrum.size > MOST_ENTRIES:
        return None
    vectors = _vectors(modes, frequencies_hz)
    matrices = np.array([np.mean(
        vectors[:, :, :, None, i] * vectors[:, :, None, :, j].conj(), axis=1) for i, j in pairs])
    matrices = (matrices + matrices.conj().swapaxes(-1, -2)).astype(np.complex64)
    found, values = spectrum, None
    for step in range(STEPS):
        lower = _lower(found, spectrum, first=step == 0)
        rows = white_vectors(lower, matrices)
        rest = white_vectors(lower, spectrum[None])
        norms = np.linalg.norm(rows, axis=1)
        inner = (rows @ rows.T) / np.outer(norms, norms) + RIDGE * np.eye(len(rows))
        values = np.linalg.solve(inner, (rows @ rest[0]) / norms) / norms
        found = np.tensordot(values, matrices, 1)
    own, alone = np.zeros(size), pairs[:, 0] == pairs[:, 1]
    own[pairs[alone, 0]] = np.abs(values[alone])
    scales = np.sqrt(own[pairs[:, 0]] * own[pairs[:, 1]])
    # the constant of one channel alone may be its noise, which no input changes: what forces do
    # to all channels at once they do to all of them
    noise = alone & (pairs[:, 0] >= count) & (pairs[:, 0] < count + width)
    common = np.tensordot(scales[noise], matrices[noise], 1)[None]
    return ForceSpectra(np.concatenate([matrices[~noise], common]), np.append(scales[~noise], 1.0),
                        bounded(found, spectrum, 1 / MISFIT, MISFIT))


def turning(before, after):
    """Return the filter (b, l, l), nearest to none, that turns one spectrum into another."""
    root = _power(before, 0.5)
    back = np.linalg.inv(root)
    return back @ _power(root @ after @ root, 0.5) @ back


def _vectors(modes, frequencies_hz):
    """Return v_i of every mode, and the two terms of every channel, (b, n, l, m + 2 l)."""
    f = frequencies_hz
    # a resonance narrower than the points lie would be missed by them
    least = (f[0, -1] - f[0, 0]) / (f.shape[1] - 1) / 2
    found = []
    for m in modes:
        f0, xi = m.frequency_hz, max(m.damping_ratio, least / m.frequency_hz)
        shape = np.real(m.shape / m.shape[np.argmax(np.abs(m.shape))])
        found.append((2 * xi * f ** 2 / (f0 ** 2 - f ** 2 + 2j * xi * f0 * f))[..., None] * shape)
    for term in (np.ones_like(f), (f / f.max()) ** 2):
        found += [term[..., None] * e for e in np.eye(len(modes[0].shape))]
    return np.stack(found, -1)


def _lower(model, spectrum, first):
    """Return the inverse Cholesky factor that whitens by a model, (b, l, l)."""
    # a model that is far from the spectrum, or no spectrum, gives no weights
    middle = (model + spectrum) / 2
    if np.linalg.eigvalsh(middle).min() <= 0.0:
        middle = bounded(middle, spectrum, *BOUNDED)
    weights = middle if first else bounded(model, middle, *BOUNDED)
    return inverse_root(weights)


def bounded(model, usual, low, high):
    """Return a model with its eigenvalues over another, positive one inside bounds."""
    factor = np.linalg.cholesky(usual)
    lower = np.linalg.inv(factor)
    values, vectors = np.linalg.eigh(lower @ model @ lower.conj().swapaxes(-1, -2))
    vectors = factor @ vectors
    return (vectors * np.clip(values, low, high)[:, None, :]) @ vectors.conj().swapaxes(-1, -2)


def _power(matrices, exponent):
    values, vectors = np.linalg.eigh(matrices)
    values = np.maximum(values, 1e-300) ** exponent
    return (vectors * values[:, None, :]) @ vectors.conj().swapaxes(-1, -2)
