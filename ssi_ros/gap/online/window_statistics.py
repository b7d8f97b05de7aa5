"""Statistics of one hop, and the leading ones of a window; eq. (130), (134) and (135)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.effects import ModalPattern, Site
from ssi_ros.effects.registry import showing
from ssi_ros.gap.spectra.segmentation import periodograms
from ssi_ros.hermitian import inverse_root, white_vectors
from ssi_ros.tails import gamma, norm


@dataclass(frozen=True, eq=False)
class Projection:
    """Projection of a hop on the templates at some levels: all but its samples."""

    base: np.ndarray    # (1, k, l, l), expected periodograms
    lower: np.ndarray   # (1, k, l, l), inverse of their Cholesky factor
    basis: np.ndarray   # (k l l, c), orthonormal whitened directions of the levels, no gap
    size: np.ndarray    # (t,), deviation of each template's product with the excess
    aim: np.ndarray     # (k, l), whitened response to a line, of norm 1


def level_basis(shares, lower):
    """Return orthonormal whitened directions of the levels of shares, shape (k l l, c)."""
    return np.linalg.qr(np.array([white_vectors(lower, s)[0] for s in shares]).T)[0]


def project(model, levels):
    """Return the Projection on the templates of a LiveModel at fitted levels."""
    base = model.expected.at(levels)
    lower = inverse_root(base)
    basis = level_basis(model.expected.shares, lower).astype(np.float32)
    rest = 1.0 - np.sum((model.templates @ basis) ** 2, axis=1)
    aim = np.einsum('kij,kj->ki', lower[0], model.line)
    size = np.sqrt(np.maximum(rest, 1e-6) * model.frame.inflation)
    return Projection(base, lower, basis, size, aim / np.linalg.norm(aim, axis=1, keepdims=True))


def statistics(model, projection, spectrum):
    """
    Return the standardised scores of one hop against all templates, and its power in all lines.

    Of a spectrum (k, l): scores (t,) of mean 0 and variance 1 where the model is right, eq. (130),
    then exponential variables (k,) less their mean of 1, eq. (134).
    """
    excess = periodograms(spectrum[None]) - projection.base
    excess = white_vectors(projection.lower, excess)[0].astype(np.float32)
    excess = excess - projection.basis @ (projection.basis.T @ excess)
    line = np.einsum('ki,ki->k', projection.aim.conj(),
                     np.einsum('kij,kj->ki', projection.lower[0], spectrum))
    return np.concatenate([(model.templates @ excess / projection.size).astype(float),
                           np.abs(line) ** 2 - 1.0])


def leading(model, hops):
    """
    Return the shares of the sites and the leading effect of a window, as fields of a GapUpdate.

    From statistics (t + k,) of each hop; it is that of the most improbable template or line.
    """
    total, count = np.sum(hops, axis=0), len(hops)
    scores = total[:len(model.names)] / np.sqrt(count)
    named = np.array([bool(site) for site in model.sites])
    best = int(np.argmax(np.where(named, np.abs(scores), -1.0)))
    # logarithms of the chance that one of all is so large
    rare = np.log(2 * named.sum()) + norm.logsf(abs(scores[best]))
    lines = total[len(model.names):] + count         # each a gamma variable of as many hops
    top = int(np.argmax(lines))
    rare_line = np.log(len(lines)) + gamma.logsf(lines[top], count)
    sites = dict.fromkeys((s.value for s in Site), 0.0)
    for site, z in zip(model.sites, scores):
        if site:
            sites[site] = max(sites[site], float(z) ** 2)
    found = {'leading': model.names[best], 'leading_text': model.texts[best],
             'leading_z': float(scores[best]), 'leading_p': float(np.exp(min(rare, 0.0)))}
    if rare_line < min(rare, 0.0):
        z = float(np.sqrt(-2.0 * rare_line))         # a Gaussian of about that chance
        sites[Site.EXCITATION.value] = max(sites[Site.EXCITATION.value], z ** 2)
        found = {'leading': showing(ModalPattern.LINE)[0],
                 'leading_text': model.texts[len(model.names) + top], 'leading_z': z,
                 'leading_p': float(np.exp(rare_line))}
    whole = sum(sites.values())
    return found | {'sites': {s: v / whole if whole > 0.0 else 0.0 for s, v in sites.items()}}
