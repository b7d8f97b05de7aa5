"""The test for shapes of gaps that are known and in no effect of the library, (105a) to (105c)."""
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import chi2, norm
from ssi_ros.gap.ringing import as_gaussian
from ssi_ros.gap.scores import directions, score, Scores, Templates
from ssi_ros.gap.strangers import make_strangers
from ssi_ros.gap.symptoms import Oddity, SURE
from ssi_ros.gap.wanderers import make_wanderers, wandering

LEAST = 1e-3            # share of information below which modes do not differ by themselves


@dataclass(frozen=True, eq=False)
class Strange:
    """Templates of what is strange all the time, and of what wanders over a record."""

    always: Templates
    wanders: Templates


def make_strange(simulator):
    """Compute all templates of strangers around the simulator's nominal spectrum."""
    return Strange(make_strangers(simulator), make_wanderers(simulator))


def strange_directions(strange, fitted, evidence, tolerance):
    """Return both kinds of templates as a fit whitens them; arguments as of `score`."""
    return tuple(directions(t, fitted, evidence, tolerance)
                 for t in (strange.always, strange.wanders))


def score_strangers(strangers, fitted, evidence, tolerance, here=None):
    """Return scores, as `score` does, of what is strange all the time, (105b)."""
    found = score(strangers, fitted, evidence, tolerance, here)
    z = found.z / [s.scatter for s in found.effects]
    return replace(found, z=as_gaussian(z, np.array([s.count for s in found.effects])))


def strange_scores(strange, fitted, evidence, tolerance, here=None):
    """
    Score all strangers, each as a standard Gaussian where the model is right.

    Parameters
    ----------
    strange : Strange
        Of the nominal.
    fitted, evidence, tolerance
        As of `score`.
    here : tuple of Directions, optional
        Of `strange_directions`, where those of a fit near by will do.

    Returns
    -------
    Scores
        With a Stranger for every effect.

    """
    always, wanders = here or strange_directions(strange, fitted, evidence, tolerance)
    one = score_strangers(strange.always, fitted, evidence, tolerance, always)
    two = wandering(wanders, fitted, evidence)
    return Scores(one.effects + two.effects, np.append(one.z, two.z),
                  np.append(one.size, two.size), np.append(one.detection, two.detection),
                  block_diag(one.cosine, two.cosine))


def strange_sign(scores):
    """
    Return the sign of the likeliest stranger, if one is there.

    Parameters
    ----------
    scores : Scores
        Of `strange_scores`.

    Returns
    -------
    tuple of Oddity
        None or one.

    """
    adds, z = np.array([s.adds for s in scores.effects]), scores.z
    tails = np.where(adds, norm.sf(z), 2 * norm.sf(np.abs(z)))
    best = int(np.argmin(tails))
    p = float(min(1.0, 2 * len(tails) * tails[best]))
    text = f'it looks like {scores.effects[best].text}, {abs(z[best]):.1f} sd'
    together, count = _together(scores)
    if 2 * together < p:
        p = 2 * together
        text = f'its modes differ, each in its own way, in {count} numbers'
    return (Oddity('a stranger', p, text),) if p <= SURE else ()


def _together(scores):
    """Return the p-value of all numbers of all modes at once, and how many tell of themselves."""
    modal = np.flatnonzero([s.modal for s in scores.effects])
    values, vectors = np.linalg.eigh(scores.cosine[np.ix_(modal, modal)])
    told = values > LEAST * values[-1]
    sizes = (vectors.T[told] @ scores.z[modal]) ** 2 / values[told]
    return float(chi2.sf(sizes.sum(), len(sizes))), len(sizes)
