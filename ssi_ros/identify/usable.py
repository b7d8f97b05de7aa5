"""Which channels and hops of a window can be identified; section 6 of the theory."""
import numpy as np

from ssi_ros.identify.lags import PRESENT_MIN

PAIRS_MIN = 0.1         # of its samples that a channel must have in pairs of any one lag
STILL_MAX = 0.5         # of the window that a channel may be absent
HOPS_MIN = 0.5          # of the window that must remain without the torn hops; else they count too
SAME = 1e-9             # correlation short of 1 by less: a copy
CONSTANT = 1e-9         # rms over offset of a channel that only rounds


def usable(ring, covariances, offset, names, rows):
    """
    Look for channels and hops that must be left out.

    Where one channel is missing or stands still for a while, the covariances with it are those of
    another time than the rest; together they are of no motion at all, and a mode more appears in
    them. So all channels leave such hops out, as long as enough of the window remains.

    Parameters
    ----------
    ring : Ring
        Of the first band.
    covariances : Covariances
        Of all its hops.
    offset : ndarray, shape (l,)
        What was taken from the channels.
    names : sequence of str
        Of the channels.
    rows : float
        Rows that the window should hold.

    Returns
    -------
    live : ndarray of bool, shape (l,)
        The channels that can be identified.
    keep : ndarray of bool, shape (filled hops,), or None
        The hops that count, None for all.
    words : str
        What is wrong with the others.

    """
    present = ring.present.sum(axis=0)
    share = np.minimum(present / max(1.0, rows), 1.0)
    sparse = share < PRESENT_MIN
    flat = ~sparse & (covariances.scale <= CONSTANT * np.abs(offset))
    pairs = np.diagonal(ring.total, axis1=1, axis2=2).min(axis=0)
    lonely = ~(sparse | flat) & (pairs < PAIRS_MIN * present)
    # then its rate is another one, and the grid may be at neither: nothing is safe
    live = ~(sparse | flat) & (not lonely.any())
    words = [f'channel {names[k]} misses {100 * (1 - share[k]):.0f} % of its samples'
             for k in np.flatnonzero(sparse)]
    words += [f'channel {names[k]} is constant' for k in np.flatnonzero(flat)]
    words += [f'channel {names[k]} misses samples so regularly that some lags have no pairs: is '
              'its rate another one?'
              for k in np.flatnonzero(lonely)]
    for k in np.flatnonzero(live):
        for j in np.flatnonzero(live[:k]):
            if abs(covariances.values[0, j, k]) > 1.0 - SAME:
                live[k] = False
                words.append(f'channels {names[j]} and {names[k]} are identical')
                break
    absent, block_of = ring.absent()
    gone = absent.mean(axis=0)
    best = _together(absent, live & (gone <= STILL_MAX))
    words += [f'channel {names[k]} is missing or stands still in {100 * gone[k]:.0f} % of the '
              'window and is left out' for k in np.flatnonzero(live & ~best)]
    live = best
    keep = ~absent[:, live].any(axis=1)[block_of]
    if keep.all() or keep.mean() < HOPS_MIN:
        keep = None
    elif live.any():
        words.append(f'{100 * (1 - keep.mean()):.0f} % of the window, where a channel is missing '
                     'or stands still, is left out')
    return live, keep, '; '.join(words)


def _together(absent, live):
    """Return the channels that hold most together: channels times blocks that have them all."""
    order = np.argsort(absent.mean(axis=0), kind='stable')
    order = order[live[order]]
    worth = [k * np.mean(~absent[:, order[:k]].any(axis=1)) for k in range(1, len(order) + 1)]
    out = np.zeros_like(live)
    if len(order):
        # of equals the larger set: shapes have more components
        out[order[:len(order) - int(np.argmax(worth[::-1]))]] = True
    return out
