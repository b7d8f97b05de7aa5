"""
Tracking: the same mode keeps its identity from window to window.

Section 8 of docs/theory-identification.md.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.identify.shapes import mac
from ssi_ros.scipy_later import linear_sum_assignment

PATIENCE = 30           # windows that a mode may miss before its identity ends
GATE = 6.0              # largest change of frequency, in spreads of the difference
FLOOR = 0.002           # relative change of frequency that is always within the gate
MAC_GATE = 0.1          # of the remembered shape; shapes of a close pair are mixed at times
MAC_WEIGHT = 4.0        # a wrong shape costs more than any change of frequency within the gate
MEMORY = 100            # windows over which a shape is remembered
MIXED = 0.1             # of a shape's square that a second one must add for it to hold them both
ALIKE = 0.9             # MAC of two shapes beyond which only their frequencies part two modes
OVERLAP = 3.0           # half-widths of both peaks within which they may be seen as one
SETTLED = 3             # windows in which an identity was seen before it can become two


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
    within : int
        The identity that holds this one too, since the window could not part them; -1 for none.

    """

    mode: object
    shape: np.ndarray
    seen: int = 1
    missed: int = 0
    within: int = -1


@dataclass(frozen=True)
class Tracks:
    """
    All identities alive, and what became of them in the last window.

    Attributes
    ----------
    alive : tuple of Track
        The identities.
    next_identity : int
        The next free number.
    splits, merges : tuple of (int, int)
        Two identities that were one, or became one, in the last window: first the one that kept
        its name throughout.

    """

    alive: tuple = ()
    next_identity: int = 1
    splits: tuple = ()
    merges: tuple = ()


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
    # new identities count up with the frequency, as the numbers of the modes on a page do
    new = sorted(set(range(len(modes))) - set(matched), key=lambda m: modes[m].frequency_hz)
    born = {m: tracks.next_identity + k for k, m in enumerate(new)}
    births, number = list(born.values()), tracks.next_identity + len(new)
    named = [replace(mode, identity=born[m] if m in born else alive[matched[m]].mode.identity)
             for m, mode in enumerate(modes)]
    kept = [_seen(alive[matched[m]] if m in matched else None, mode)
            for m, mode in enumerate(named)]
    deaths = []
    for a in sorted(set(range(len(alive))) - {a for a, _ in pairs}):
        if alive[a].missed + 1 > patience:
            deaths.append(alive[a].mode.identity)
        else:
            kept.append(replace(alive[a], missed=alive[a].missed + 1))
    merges, kept = _merges(alive, kept)
    splits = _splits(alive, kept, births)
    named.sort(key=lambda m: m.frequency_hz)
    return (Tracks(tuple(kept), number, splits, merges), tuple(named), tuple(births),
            tuple(deaths))


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
    step, allowed = _steps([t.mode for t in alive], modes)
    likeness = mac(np.array([t.shape for t in alive]), np.array([m.shape for m in modes]))
    barred = (step > allowed) | (likeness < MAC_GATE)
    cost = step / allowed + MAC_WEIGHT * (1.0 - likeness)
    cost[barred] = 1e3
    return [(a, m) for a, m in zip(*linear_sum_assignment(cost)) if not barred[a, m]]


def _steps(old, new):
    """Return how far modes are from those before in frequency, and how far they may be."""
    old = np.array([(m.frequency_hz, m.frequency_std_hz) for m in old])
    new = np.array([(m.frequency_hz, m.frequency_std_hz) for m in new])
    spread = np.sqrt(np.nan_to_num(old[:, 1:]) ** 2 + np.nan_to_num(new[:, 1]) ** 2)
    return np.abs(old[:, :1] - new[:, 0]), np.maximum(GATE * spread, FLOOR * old[:, :1])


def _near(one, other):
    step, allowed = _steps([one], [other])
    widths = sum(abs(m.damping_ratio) * m.frequency_hz for m in (one, other))
    return bool(step[0, 0] <= max(allowed[0, 0], OVERLAP * widths))


def holds_both(one, first, second):
    """
    Tell whether a mode may be two others, whose peaks overlap, seen as one.

    Its shape is a mixture of theirs: the nearer one leaves at least `MIXED` of its square to the
    plane of both. Where the two shapes are alike nothing but resolution keeps them apart, and the
    answer is yes.

    Parameters
    ----------
    one, first, second : ndarray, shape (l,)
        Shapes of unit norm.

    Returns
    -------
    bool

    """
    if abs(np.vdot(first, second)) ** 2 > ALIKE:
        return True
    plane, _ = np.linalg.qr(np.array([first, second]).T)
    alone = max(abs(np.vdot(first, one)), abs(np.vdot(second, one))) ** 2
    return bool((np.abs(plane.conj().T @ one) ** 2).sum() - alone > MIXED)


def _unit(mode):
    return mode.shape / np.linalg.norm(mode.shape)


def _splits(before, now, births):
    """Return (kept, other) of every identity that became two."""
    seen = {t.mode.identity: t for t in now if not t.missed}
    # what was within another and is seen again beside it
    out = [(t.within, t.mode.identity) for t in before
           if t.within in seen and t.mode.identity in seen]
    for identity in births:
        born = seen[identity].mode
        for old in before:
            own = seen.get(old.mode.identity)
            if (own is not None and old.seen >= SETTLED and _near(old.mode, born)
                    and holds_both(old.shape, _unit(own.mode), _unit(born))):
                out.append((old.mode.identity, identity))
                break
    return tuple(out)


def _merges(before, now):
    """Return (kept, other) of every two identities that became one, and the tracks that know."""
    out, tracks, old = [], list(now), {t.mode.identity: t for t in before}
    for k, lost in enumerate(tracks):
        if not lost.missed or lost.within >= 0 or lost.seen < SETTLED:
            continue
        for own in now:
            was = old.get(own.mode.identity)
            if (was is not None and not own.missed and was.seen >= SETTLED
                    and _near(lost.mode, own.mode)
                    and holds_both(_unit(own.mode), was.shape, lost.shape)):
                out.append((own.mode.identity, lost.mode.identity))
                tracks[k] = replace(lost, within=own.mode.identity)
                break
    return tuple(out), tracks


def told(tracks):
    """Return what became of identities in the last window as text, '' if nothing did."""
    hz = {t.mode.identity: f'{t.mode.frequency_hz:.4g} Hz' for t in tracks.alive}
    return '; '.join([f'mode {a} became two: {a} ({hz[a]}) and {b} ({hz[b]})'
                      for a, b in tracks.splits]
                     + [f'modes {a} and {b} became one, which is seen as {a} ({hz[a]})'
                        for a, b in tracks.merges])
