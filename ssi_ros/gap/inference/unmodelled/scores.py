"""The score test of unmodelled changes, eq. (105a) to (105c)."""
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag
from ssi_ros.effects.base import Site
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors.thresholds import LIMITS as DETECTION
from ssi_ros.gap.inference.score_test import directions, score, Scores
from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.inference.whittle import whiten_each
from ssi_ros.tails import chi2, norm
from ssi_ros.updating.score_variance import as_gaussian

SHAPES = 4              # half periods of a cosine over the record that a drift may have


def change_directions(templates, fitted, evidence, uncertainty):
    """Return both kinds of ChangeTemplates as a fit whitens them; arguments as of `score`."""
    return tuple(directions(t, fitted, evidence, uncertainty)
                 for t in (templates.constant, templates.drifting))


def score_changes(templates, fitted, evidence, uncertainty, here=None):
    """Return the Scores of all unmodelled changes; `here` is of `change_directions`."""
    constant, drifting = here or change_directions(templates, fitted, evidence, uncertainty)
    one = score_constant(templates.constant, fitted, evidence, uncertainty, constant)
    two = score_drifts(drifting, fitted, evidence, uncertainty)
    return Scores(one.effects + two.effects, np.append(one.z, two.z),
                  np.append(one.size, two.size), np.append(one.detection, two.detection),
                  block_diag(one.cosine, two.cosine))


def score_constant(templates, fitted, evidence, uncertainty, here=None):
    """Return scores, as `score` does, of changes that stay over the record, (105b)."""
    found = score(templates, fitted, evidence, uncertainty, here)
    z = found.z if uncertainty.heights else found.z / [c.scatter for c in found.effects]
    # more energy than expected, of few independent ones, means less damping
    return replace(found, z=as_gaussian(z, [-2 / np.sqrt(c.count) for c in found.effects]))


def score_drifts(here, fitted, evidence, uncertainty):
    """Score numbers that drift over the record, in up to SHAPES shapes."""
    # The levels of all excitation and of all noise may drift: that is an effect, and is projected
    # out.
    frame = evidence.frame
    middles = frame.mean_of_parts(np.array(frame.begins))[list(evidence.parts)] + frame.rows / 2
    each = here.runs.projected(whiten_each(uncertainty.raised(fitted.model, evidence), evidence))
    levels = here.basis[:len(fitted.levels)]
    apart = here.flat - (here.flat @ levels.T) @ np.linalg.pinv(levels @ levels.T) @ levels
    halves = np.arange(min(SHAPES, len(middles) - 1) + 1)
    # orthogonal to a constant, although segments are missing
    cosines = np.cos(np.pi * np.outer(middles / (frame.begins[-1] + frame.rows), halves))
    shapes = np.linalg.qr(cosines)[0][:, 1:]
    inner = (apart @ apart.T).astype(float)
    spread = np.sqrt(np.maximum(np.diag(inner), 1e-30) * frame.inflation)
    z = (apart @ each.T @ shapes) / spread[:, None] * np.sqrt(evidence.each_of)
    cosine = np.kron(np.eye(shapes.shape[1]), inner / np.outer(spread, spread) * frame.inflation)
    count = shapes.shape[1]
    return Scores(here.effects * count, z.T.ravel().astype(float), np.tile(1.0, z.size),
                  np.tile(spread, count), cosine)


def detect_change(scores):
    """Return a Detection of the most improbable of `score_changes`, or none, as a tuple."""
    positive, z = np.array([c.positive for c in scores.effects]), scores.z
    tails = np.where(positive, norm.sf(z), 2 * norm.sf(np.abs(z)))
    best = int(np.argmin(tails))
    # two tests, the largest score and all modes together, share the p-value
    trials = 2 * len(tails)
    p = float(min(1.0, trials * tails[best]))
    text = (f'the residual has the shape of {scores.effects[best].text}, '
            f'{abs(z[best]):.1f} standard deviations')
    site, (together, count) = scores.effects[best].site, _of_all_modes(scores)
    if 2 * together < p:
        p, site = 2 * together, Site.STRUCTURE.value
        text = (f'frequencies and dampings of single modes differ from the model, in {count} '
                'numbers together')
    if p > DETECTION.p_value.value:
        return ()
    return (Detection('', {}, p, text, trials=trials, basis='unmodelled change', site=site),)


def _of_all_modes(scores):
    """Return the p-value of all numbers of all modes together, and how many are distinguished."""
    modal = np.flatnonzero([c.modal for c in scores.effects])
    values, vectors = np.linalg.eigh(scores.cosine[np.ix_(modal, modal)])
    kept = values > LIMITS.distinct_modes.value * values[-1]
    sizes = (vectors.T[kept] @ scores.z[modal]) ** 2 / values[kept]
    return float(chi2.sf(sizes.sum(), len(sizes))), len(sizes)
