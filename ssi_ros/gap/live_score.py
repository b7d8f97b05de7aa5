"""Statistics of one hop, and what those of a window point at; eq. (130), (134) and (135)."""
from dataclasses import dataclass

import numpy as np
from scipy.stats import gamma, norm

from ssi_ros.effects import Site
from ssi_ros.gap.likelihood import real_vectors, white
from ssi_ros.gap.spectra import periodograms


@dataclass(frozen=True, eq=False)
class Sight:
    """
    How a hop is seen at some levels: all that does not depend on its samples.

    Attributes
    ----------
    base, lower : ndarray, shape (1, k, l, l)
        Expected periodograms, and the inverse of their Cholesky factor.
    basis : ndarray, shape (k l l, c)
        Orthonormal whitened directions of the levels: a change of these alone is no gap.
    size : ndarray, shape (t,)
        Standard deviation of each template's product with the whitened excess.
    aim : ndarray, shape (k, l)
        Whitened response to a line, of norm 1.

    """

    base: np.ndarray
    lower: np.ndarray
    basis: np.ndarray
    size: np.ndarray
    aim: np.ndarray


def sight(model, levels):
    """Return how a hop is seen by a LiveModel at fitted levels, as a Sight."""
    base = model.expected.at(levels)
    lower = np.linalg.inv(np.linalg.cholesky(base))
    basis = np.linalg.qr(np.array([real_vectors(white(lower, share))[0]
                                   for share in model.expected.shares]).T)[0].astype(np.float32)
    left = 1.0 - np.sum((model.templates @ basis) ** 2, axis=1)
    aim = np.einsum('kij,kj->ki', lower[0], model.line)
    return Sight(base, lower, basis, np.sqrt(np.maximum(left, 1e-6) * model.frame.crowding),
                 aim / np.linalg.norm(aim, axis=1, keepdims=True))


def statistics(model, seen, spectrum):
    """
    Return the standardised scores of one hop against all templates, and its power in all lines.

    Parameters
    ----------
    model : LiveModel
        Its templates.
    seen : Sight
        Of the hop's levels.
    spectrum : ndarray, shape (k, l)
        Of the hop.

    Returns
    -------
    ndarray, shape (t + k,)
        Scores of mean 0 and variance 1 where the model is right, eq. (130), then exponential
        variables less their mean of 1, eq. (134).

    """
    excess = real_vectors(white(seen.lower, periodograms(spectrum[None]) - seen.base))[0]
    excess = excess.astype(np.float32)
    excess = excess - seen.basis @ (seen.basis.T @ excess)
    line = np.einsum('ki,ki->k', seen.aim.conj(),
                     np.einsum('kij,kj->ki', seen.lower[0], spectrum))
    return np.concatenate([(model.templates @ excess / seen.size).astype(float),
                           np.abs(line) ** 2 - 1.0])


def leading(model, hops):
    """
    Return what the statistics of a window's hops point at, as the fields of a GapUpdate.

    Parameters
    ----------
    model : LiveModel
        Gives names and sites.
    hops : list of ndarray, shape (t + k,)
        Statistics of each hop.

    Returns
    -------
    dict
        Shares of the sites, and the effect of the most improbable statistic: a template of the
        library, or the strongest line.

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
        found = {'leading': 'harmonic_disturbance',
                 'leading_text': model.texts[len(model.names) + top], 'leading_z': z,
                 'leading_p': float(np.exp(rare_line))}
    whole = sum(sites.values())
    return found | {'sites': {s: v / whole if whole > 0.0 else 0.0 for s, v in sites.items()}}
