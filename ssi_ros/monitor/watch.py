"""What an operator watches: the last windows, the health of all, the gap; a frozen record."""
from dataclasses import dataclass, field, replace

KEPT = 60               # windows and values of the gap that are remembered


@dataclass(frozen=True)
class Status:
    """One line of health: level 'ok', 'warn', 'error' or 'stale', and what it says."""

    name: str
    level: str
    text: str
    values: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Watch:
    """
    All that has been heard.

    Attributes
    ----------
    windows : tuple of WindowModes
        The last ones, by rising time.
    health : dict of str to Status
        By name.
    gap, floor, deviations : tuple of float
        The last values of the gap node; empty where none runs.
    where : tuple of Status
        What the gap node says of the last window.
    heard_s : float
        When the last message came, by the machine's own clock [s].

    """

    windows: tuple = ()
    health: dict = field(default_factory=dict)
    gap: tuple = ()
    floor: tuple = ()
    deviations: tuple = ()
    where: tuple = ()
    heard_s: float = float('nan')


def with_window(watch, window, now_s):
    """Return the watch with one window more; one that is not later begins a new run."""
    last = watch.windows[-1:]
    if last and window.end_ns <= last[0].end_ns:
        return replace(watch, windows=(window,), heard_s=now_s)
    return replace(watch, windows=(watch.windows + (window,))[-KEPT:], heard_s=now_s)


def with_health(watch, statuses, now_s):
    """Return the watch with the statuses in place of earlier ones of the same names."""
    return replace(watch, health=watch.health | {s.name: s for s in statuses}, heard_s=now_s)


def with_gap(watch, name, value, now_s):
    """Return the watch with one more value of 'gap', 'floor' or 'deviations'."""
    return replace(watch, heard_s=now_s, **{name: (getattr(watch, name) + (value,))[-KEPT:]})


def with_where(watch, statuses, now_s):
    """Return the watch with what the gap node says of its last window."""
    return replace(watch, where=tuple(statuses), heard_s=now_s)


def histories(windows):
    """
    Return the modes by identity over windows, None where one was missed.

    Identities that ended are left out.

    Returns
    -------
    dict of int to list of (Mode or None)
        By rising frequency.

    """
    gone = {identity for w in windows for identity in w.deaths}
    found = {}
    for k, w in enumerate(windows):
        for m in w.modes:
            if m.identity not in gone:
                found.setdefault(m.identity, [None] * len(windows))[k] = m

    def last(history):
        return next(m for m in reversed(history) if m is not None).frequency_hz
    return dict(sorted(found.items(), key=lambda item: last(item[1])))
