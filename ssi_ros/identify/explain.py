"""What became of the poles near a frequency: "where did my poles above 20 Hz go?"."""
from ssi_ros.quantity import with_spread

NEAR = 0.05             # relative distance of the poles that are told about
LINES = 12


def explain(window, frequency_hz):
    """
    Tell what was found near a frequency, and why the rest was left out.

    Parameters
    ----------
    window : WindowModes
        With its rejected poles.
    frequency_hz : float
        Where to look [Hz].

    Returns
    -------
    str
        A line a mode and a line a rejected pole, nearest first, one for each order and reason.

    Raises
    ------
    ValueError
        If the frequency is not positive.

    """
    if not frequency_hz > 0.0:
        raise ValueError(f'frequency_hz={frequency_hz} must be a positive number [Hz]')

    def distance(item):
        return abs(item.frequency_hz - frequency_hz)

    modes = sorted((m for m in window.modes if distance(m) < NEAR * frequency_hz), key=distance)
    poles = sorted((p for p in window.rejected if distance(p) < NEAR * frequency_hz),
                   key=distance)
    lines = [f'mode {m.identity}: {with_spread(m.frequency_hz, m.frequency_std_hz, 4)} Hz, '
             f'damping {with_spread(100 * m.damping_ratio, 100 * m.damping_ratio_std, 2)} %, '
             + m.label + (f' ({m.note})' if m.note else '') for m in modes]
    seen = set()
    for p in poles:
        if (p.order, p.reason) not in seen and len(seen) < LINES:
            seen.add((p.order, p.reason))
            order = f'order {p.order}' if p.order else 'all orders'
            lines.append(f'pole {p.frequency_hz:.4f} Hz, damping {100 * p.damping_ratio:.2f} %, '
                         f'{order}: {p.reason}')
    if not lines:
        lines = [f'no pole within {100 * NEAR:g} % of {frequency_hz:g} Hz at any order: nothing '
                 'there stands above the noise of this window']
    if window.reason:
        lines.append(f'the window: {window.reason}')
    return '\n'.join(lines)
