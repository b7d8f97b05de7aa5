"""The debiased Whittle likelihood, and a record whitened by a model, eq. (97) to (99)."""
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ssi_ros.gap.spectra.segmentation import Frame, periodograms
from ssi_ros.hermitian import inverse_root, white_excess, white_vectors
from threadpoolctl import ThreadpoolController

BLAS = ThreadpoolController()       # more threads only slow these small matrices down


@dataclass(frozen=True, eq=False)
class Evidence:
    """Spectra of a record, shape (segments, k, l), and the segments that count."""

    frame: Frame
    spectrum: np.ndarray
    segments: tuple
    others: tuple = ()  # Evidence of more records of the same model, cut alike
    known: int = 0      # channels, the first ones, that are given: inputs

    def only(self, segments):
        """Return the evidence of some segments."""
        return Evidence(self.frame, self.spectrum, tuple(segments), known=self.known)

    @cached_property
    def halves(self):
        """Return the evidence of every other segment, from the first and from the second."""
        return tuple(self.only(self.segments[first::2]) for first in (0, 1))

    @cached_property
    def parts(self):
        """Parts of the frame that its segments are in."""
        return tuple(dict.fromkeys(self.frame.parts_of(self.segments).tolist()))

    @cached_property
    def each(self):
        """Periodograms of the parts, the mean over segments and records, (n, k, l, l)."""
        which, at = np.array(self.segments), self.frame.parts_of(self.segments)
        own = np.stack([periodograms(self.spectrum[which[at == p]]).mean(axis=0)
                        for p in self.parts])
        return (own + sum(o.each for o in self.others)) / (1 + len(self.others))

    @cached_property
    def mean(self):
        """Their mean, shape (1, k, l, l)."""
        own = sum(periodograms(self.spectrum[s:s + 1]) for s in self.segments)
        return (own / len(self.segments) + sum(o.mean for o in self.others)) / (
            1 + len(self.others))

    def against(self, model):
        """Return periodograms as a model needs them, of how many segments each, and it."""
        records = 1 + len(self.others)
        if len(model) == 1:         # the same for all segments: it needs only their mean
            return self.mean, records * len(self.segments), model
        return self.each, records * self.each_of, model[list(self.parts)]

    @property
    def powers(self):
        """Return the power of each of its segments in all bins and channels, (segments,)."""
        return np.array([np.vdot(y, y).real for y in map(self.spectrum.__getitem__,
                                                         self.segments)])

    @property
    def each_of(self):
        """Segments that a part has, in the mean."""
        return len(self.segments) / len(self.parts)


@dataclass(frozen=True, eq=False)
class Whitened:
    """A record whitened by a model: white where the model is right."""

    lower: np.ndarray   # (a, k, l, l), inverse of the Cholesky factor of S
    excess: np.ndarray  # (a, k l l), whitened less the identity, as real vectors
    likelihood: float   # eq. (97), logarithm; -inf where S is not positive definite
    weight: float       # periodograms an entry of `excess` stands for, over inflation
    parts: tuple        # of the evidence
    known: int = 0      # channels of it that are given
    heights: np.ndarray = ()    # (s,), of modes, in deviations, that are taken out of it

    def directions(self, changes):
        """Return changes of S, (1 or all segments, k, l, l), as real vectors, (p, a, k l l)."""
        many = len(self.lower)
        out = np.empty((len(changes), *self.excess.shape))
        for row, change in zip(out, changes):
            if len(change) > 1:
                # a model that is the same for all segments is compared with the mean change
                change = change[list(self.parts)]
                change = change if many > 1 else change.mean(axis=0, keepdims=True)
            row[:] = white_vectors(self.lower, change)
        return out


def whiten(model, evidence):
    """Whiten an Evidence by expected periodograms (a, k, l, l), with a = 1 or all segments."""
    observed, count, model = evidence.against(model)
    weight = count / evidence.frame.inflation
    try:
        lower = inverse_root(model)
    except np.linalg.LinAlgError:
        return Whitened(model, np.zeros((len(model), 0)), -np.inf, weight, evidence.parts,
                        evidence.known)
    flat = white_vectors(lower, observed)
    diagonal = np.einsum('akii->aki', lower).real
    own = np.einsum('akii->aki', flat.reshape(lower.shape))
    value = weight * (2 * np.log(diagonal).sum() - own.sum())
    own -= 1.0
    return Whitened(lower, flat, float(value) if np.isfinite(value) else -np.inf,
                    weight, evidence.parts, evidence.known)


def whiten_each(model, evidence):
    """Return the excess of each part as in `Whitened`, (n, k l l), by a model (1 or a, ...)."""
    if len(model) > 1 or evidence.others or evidence.each_of > 1:
        return whiten(np.broadcast_to(model, (evidence.frame.parts, *model.shape[1:])),
                      evidence).excess
    return white_excess(inverse_root(model[0]), evidence.spectrum[list(evidence.segments)])
