"""
Tracking: the same mode keeps its identity from window to window.

Section 8 of docs/theory-identification.md.
"""
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from ssi_ros.identify.shapes import mac

PATIENCE = 30           # windows that a mode may miss before its identity ends
GATE = 6.0              # largest change of frequency, in spreads of the difference
FLOOR = 0.002           # relative change of frequency that is always within the gate
MAC_GATE = 0.1          # of the remembered shape; shapes of a close pair are mixed at times
MAC_WEIGHT = 4.0        # a wrong shape costs more than any change of frequency within the gate
MEMORY = 100            # windows over which a shape is remembered


@dataclass(frozen=True)
class Track:
    """
    What is remembered of one identity.

    Attributes
    ----------
    mode : Mode
        As it was seen last.
    shape : ndarray, shape (l,)
        Mean of its shapes, of unit norm. The shapes of two modes that the window cannot part
        wander into mixtures and back; who follows the last one ends on the other mode.
    seen, missed : int
        Windows in which it was seen, and windows since.

    """

    mode: object
    shape: np.ndarray
    seen: int = 1
    missed: int = 0


@dataclass(frozen=True)
class Tracks:
    """All identities alive, and the next free number."""

    alive: tuple = ()
    next_identity: int = 0


def track(tracks, modes, patience=PATIENCE):
    """
    Give the modes of a window their identities.

    Parameters
    ----------
    tracks : Tracks
        From the window before.
    modes : sequence of Mode
        Of this window, without identities.
    patience : int
        Windows that a mode may miss before its identity ends.

    Returns
    -------
    tracks : Tracks
        To hand in with the next window.
    modes : tuple of Mode
        By rising frequency, with identities.
    births, deaths : tuple of int
        Identities that began and ended.

    """
    alive, modes = list(tracks.alive), list(modes)
    pairs = _pairs(alive, modes) if alive and modes else []
    matched = {m: a for a, m in pairs}
    births, named, number = [], [], tracks.next_identity
    for m, mode in enumerate(modes):
        if m in matched:
            identity = alive[matched[m]].mode.identity
        else:
            identity, number = number, number + 1
            births.append(identity)
        named.append(replace(mode, identity=identity))
    kept = [_seen(alive[matched[m]] if m in matched else None, mode)
            for m, mode in enumerate(named)]
    deaths = []
    for a in sorted(set(range(len(alive))) - {a for a, _ in pairs}):
        if alive[a].missed + 1 > patience:
            deaths.append(alive[a].mode.identity)
        else:
            kept.append(replace(alive[a], missed=alive[a].missed + 1))
    return (Tracks(tuple(kept), number), tuple(sorted(named, key=lambda m: m.frequency_hz)),
            tuple(births), tuple(deaths))


def _seen(old, mode):
    """Return the track of a mode, its shape turned to the remembered one and averaged in."""
    shape = mode.shape / np.linalg.norm(mode.shape)
    if old is None:
        return Track(mode, shape)
    phase = np.vdot(shape, old.shape)
    phase /= abs(phase) or 1.0
    share = 1.0 / min(old.seen + 1, MEMORY)
    mean = (1.0 - share) * old.shape + share * phase * shape
    return Track(mode, mean / np.linalg.norm(mean), old.seen + 1)


def _pairs(alive, modes):
    """Return (track, mode) pairs of least total cost within the gates."""
    old = np.array([(t.mode.frequency_hz, t.mode.frequency_std_hz) for t in alive])
    new = np.array([(m.frequency_hz, m.frequency_std_hz) for m in modes])
    step = np.abs(old[:, :1] - new[:, 0])
    spread = np.sqrt(np.nan_to_num(old[:, 1:]) ** 2 + np.nan_to_num(new[:, 1]) ** 2)
    allowed = np.maximum(GATE * spread, FLOOR * old[:, :1])
    likeness = mac(np.array([t.shape for t in alive]), np.array([m.shape for m in modes]))
    barred = (step > allowed) | (likeness < MAC_GATE)
    cost = step / allowed + MAC_WEIGHT * (1.0 - likeness)
    cost[barred] = 1e3
    return [(a, m) for a, m in zip(*linear_sum_assignment(cost)) if not barred[a, m]]
