"""The modes of a record in one sentence."""
import math

MOVED = 5.0       # spreads of the difference: as the arrows of `ssi_ros monitor`, see there


def moved(windows):
    """
    Return the identities of the last window whose frequency moved since they appeared.

    Parameters
    ----------
    windows : sequence of WindowModes
        By rising time.

    Returns
    -------
    tuple of int

    """
    first, out = {}, []
    for window in windows:
        for m in window.modes:
            first.setdefault(m.identity, m)
    for m in windows[-1].modes:
        before = first[m.identity]
        spread = math.hypot(m.frequency_std_hz, before.frequency_std_hz)
        if math.isfinite(spread) and abs(m.frequency_hz - before.frequency_hz) > MOVED * spread:
            out.append(m.identity)
    return tuple(out)


def modes_sentence(windows):
    """Return how many modes there are, how many are structural, and which of them moved."""
    last = windows[-1]
    if not last.modes:
        return f'No mode in the last window: {last.reason or "no reason is known"}.'
    n = len(last.modes)
    structural = sum(m.label == 'structural' for m in last.modes)
    changed = moved(windows)
    names = ', '.join(f'{m.frequency_hz:.3f} Hz' for m in last.modes if m.identity in changed)
    return (f'{n} mode{"s" * (n > 1)}, {structural} structural, '
            + (f'{len(changed)} moved ({names}).' if changed else 'none moved.'))
