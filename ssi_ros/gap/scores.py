"""
Scores of all effects at once, and the search for lines, eq. (104) to (106).

A template is the change of the expected spectrum by one effect at one starting value, the levels
projected out. Templates depend on the model alone, so they are made once and kept.
"""
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ssi_ros.gap.candidate import Candidate

DRAWS = 4000


@dataclass(frozen=True, eq=False)
class Templates:
    """
    Whitened directions of effects around a model.

    Attributes
    ----------
    effects : tuple of Effect
        One a template, at its starting value.
    mean : ndarray, shape (t, k l l), real
        Direction averaged over the pieces.
    swing : dict of int to ndarray (pieces, k l l)
        Its change from piece to piece, for those that change.
    basis : ndarray, shape (c, k l l)
        Orthonormal directions of the levels.

    """

    effects: tuple
    mean: np.ndarray
    swing: dict
    basis: np.ndarray


def make_templates(simulator, model, shares, effects, progress=None):
    """Compute the templates of effects around expected periodograms `model` (1, k, l, l)."""
    lower = np.linalg.inv(np.linalg.cholesky(model))
    levels = np.stack([_real(_white(lower, s)).mean(axis=0) for s in shares])
    basis = np.linalg.qr(levels.T)[0].T.astype(np.float32)
    nominal = simulator.expected(Candidate())
    base = nominal.at(np.ones(len(nominal.names)))
    kept, means, swings = [], [], {}
    for i, effect in enumerate(effects):
        if progress is not None:
            progress(i / len(effects))
        there = simulator.expected(Candidate((effect,)))
        if there is None:
            continue
        change = _real(_white(lower, there.at(np.ones(len(there.names))) - base))
        mean = change.mean(axis=0)
        if len(change) > 1:
            swings[len(kept)] = (change - mean).astype(np.float32)
        kept.append(effect)
        means.append(mean.astype(np.float32))
    means = np.array(means)
    return Templates(tuple(kept), means - (means @ basis.T) @ basis, swings, basis)


@dataclass(frozen=True, eq=False)
class Scores:
    """Standardised score of every template, and the one-step estimate of its size."""

    effects: tuple
    z: np.ndarray
    size: np.ndarray
    cosine: np.ndarray

    def p_value(self):
        """
        Return the chance of so large a score somewhere where the model is right.

        Beyond what DRAWS of correlated Gaussians can tell, the number of independent scores that
        gives their median takes over.
        """
        values, vectors = np.linalg.eigh(self.cosine)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = np.random.default_rng(0).standard_normal((DRAWS, len(root))) @ root.T
        largest = np.abs(draws).max(axis=1)
        found = np.max(np.abs(self.z))
        share = np.mean(largest >= found)
        if share > 20 / DRAWS:
            return float(share)
        effective = np.log(0.5) / np.log1p(-2 * norm.sf(np.median(largest)))
        return float(-np.expm1(effective * np.log1p(-2 * norm.sf(found))))


def score(templates, model, evidence):
    """
    Score all templates.

    Parameters
    ----------
    templates : Templates
        Of the model.
    model : ndarray, shape (1, k, l, l)
        Expected periodograms at the fitted levels.
    evidence : Evidence
        What was recorded.

    Returns
    -------
    Scores

    """
    lower = np.linalg.inv(np.linalg.cholesky(model))
    excess = _real(_white(lower, evidence.each - model)).astype(np.float32)
    total = excess.sum(axis=0)
    total = total - templates.basis.T @ (templates.basis @ total)
    crowding, count = evidence.frame.crowding, len(evidence.pieces)
    raw = templates.mean @ total
    information = count * (templates.mean @ templates.mean.T).astype(float)
    chosen = {i: s[list(evidence.pieces)] for i, s in templates.swing.items()}
    for i, swing in chosen.items():
        raw[i] += np.sum(swing * excess)
        for j, other in chosen.items():
            information[i, j] += np.sum(swing * other)
    spread = np.sqrt(np.maximum(np.diag(information), 1e-30))
    return Scores(templates.effects, raw / spread / np.sqrt(crowding), raw / spread ** 2,
                  information / np.outer(spread, spread))


def line_search(simulator, model, evidence, inputs=('torque_x',)):
    """
    Search a line in every bin: the likelihood gain of a torque at that frequency, eq. (106).

    Returns
    -------
    frequency_hz, torque_n_m : float
        The best line.
    p_value : float
        Chance of so strong a line in any of the bins without there being one.

    """
    from ssi_ros.effects import inject
    frame = evidence.frame
    system = inject(simulator.spacecraft, (), simulator.duration_s).system
    response = system.transfer(frame.frequencies_hz, system.rate_hz)
    h = response[:, :, [system.inputs.index(i) for i in inputs]].sum(axis=2)
    inverse = np.linalg.inv(model[0])
    weight = np.einsum('kij,kj->ki', inverse, h)
    norm2 = np.einsum('ki,ki->k', h.conj(), weight).real
    seen = np.einsum('ki,skij,kj->sk', weight.conj(), evidence.each, weight).real / norm2
    # under the model every term is an exponential variable of mean 1; pieces add to a gamma
    from scipy.stats import gamma
    total = seen.sum(axis=0)
    single = gamma.sf(total, len(evidence.pieces))
    best = int(np.argmin(single))
    p = float(-np.expm1(len(total) * np.log1p(-min(single[best], 1 - 1e-16))))
    power = max(total[best] / len(evidence.pieces) - 1, 0.0) / norm2[best]
    coherent = np.sum(frame.taper) ** 2
    return float(frame.frequencies_hz[best]), float(2 * np.sqrt(power / coherent)), p


def _white(lower, change):
    return lower @ change @ lower.conj().swapaxes(-1, -2)


def _real(hermitian):
    """Return Hermitian matrices as real vectors with the same inner product, (a, k l l)."""
    # the sum of real and imaginary part keeps tr A B: the cross terms cancel by symmetry
    return (hermitian.real + hermitian.imag).reshape(len(hermitian), -1)
