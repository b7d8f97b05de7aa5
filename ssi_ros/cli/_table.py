"""Tables for the terminal."""
import math
import shutil

from ssi_ros.quantity import fixed, with_spread


def fitted(text, out):
    """Return a table whose rows are cut where a terminal ends; as it is for a pipe or a file."""
    if not out.isatty():
        return text
    width = shutil.get_terminal_size().columns
    return '\n'.join(line if len(line) <= width else line[:width - 1] + '…'
                     for line in text.split('\n'))


def mode_table(window, names):
    """Return a window's modes as text: number, identity, label, values with spreads, shape."""
    lines = [f'{"mode":>4} {"id":>4} {"label":<11}{"frequency [Hz]":>22}{"damping [%]":>18}   '
             'shape at ' + ', '.join(names)]
    for number, m in enumerate(sorted(window.modes, key=lambda m: m.frequency_hz), 1):
        shape = ' '.join(_component(z) for z in m.shape[:8])
        more = ' ...' if len(m.shape) > 8 else ''
        frequency = with_spread(m.frequency_hz, m.frequency_std_hz, 4)
        damping = with_spread(100 * m.damping_ratio, 100 * m.damping_ratio_std, 2)
        lines.append(f'{number:>4} {m.identity:>4} {m.label:<11}{frequency:>22}{damping:>18}   '
                     f'{shape}{more}')
    return '\n'.join(lines)


def _component(z):
    return fixed(math.copysign(abs(z), z.real), 2, '+')


def compare(theory, count, window, tolerance=0.005):
    """
    Hold a window against theory, each mode against its own line, by frequency and shape.

    Parameters
    ----------
    theory : NaturalModes
        Of the model, with the shapes at the channels of the window.
    count : int
        How many of its modes, from the lowest on.
    window : WindowModes
        Identified.
    tolerance : float
        Relative error of a frequency that counts as found.

    Returns
    -------
    found : int
        Modes of theory that have one within `tolerance` of them.
    text : str
        The table.

    """
    frequencies_hz, damping_ratios = theory.frequencies_hz[:count], theory.damping_ratios[:count]
    nearest = pair(frequencies_hz, theory.shapes.T[:count], window)
    found = 0
    lines = [f'{"theory [Hz]":>12}{"found [Hz]":>22}{"error [%]":>11}{"damping [%]":>18}'
             f'{"theory [%]":>12}{"MAC":>7}  label']
    for f, xi, shape, m in zip(frequencies_hz, damping_ratios, theory.shapes.T, nearest):
        if m is None:
            lines.append(f'{f:12.4f}{"-":>22}{"":>11}{"":>18}{100 * xi:12.2f}{"":>7}  not found')
            continue
        error = m.frequency_hz / f - 1.0
        found += abs(error) <= tolerance
        lines.append(f'{f:12.4f}{with_spread(m.frequency_hz, m.frequency_std_hz, 4):>22}'
                     f'{fixed(100 * error, 3):>11}'
                     f'{with_spread(100 * m.damping_ratio, 100 * m.damping_ratio_std, 2):>18}'
                     f'{100 * xi:12.2f}{_mac(m.shape, shape):7.3f}  {m.label}')
    others = [m for m in window.modes if all(m is not n for n in nearest)]
    lines += [f'{"none":>12}{with_spread(m.frequency_hz, m.frequency_std_hz, 4):>22}'
              f'{"":>11}{with_spread(100 * m.damping_ratio, 100 * m.damping_ratio_std, 2):>18}'
              f'{"":>19}  {m.label}' for m in others]
    return found, '\n'.join(lines)


def _mac(one, other):
    from ssi_ros.identify.shapes import mac
    import numpy as np
    return float(mac(np.asarray(one)[None], np.asarray(other)[None])[0, 0])


def pair(frequencies_hz, shapes, window, reach=0.03):
    """
    Return for each line of theory the mode that belongs to it, or None.

    Assignment at the least sum of distances in frequency, over `reach`, and 1 - MAC: modes closer
    than their spreads are distinguished by their shapes.
    """
    from ssi_ros.identify.shapes import mac      # with all of the identification
    import numpy as np
    from scipy.optimize import linear_sum_assignment
    if not window.modes:
        return [None] * len(frequencies_hz)
    found = np.array([m.frequency_hz for m in window.modes])
    theory = np.asarray(frequencies_hz)[:, None]
    distance = np.minimum(np.abs(found / theory - 1.0), 10.0 * reach)
    unlike = 1.0 - mac(np.asarray(shapes), np.array([m.shape for m in window.modes]))
    out = [None] * len(frequencies_hz)
    for i, j in zip(*linear_sum_assignment(distance / reach + unlike)):
        if distance[i, j] <= reach and unlike[i, j] < 0.5:
            out[i] = window.modes[j]
    return out


def largest_difference(one, other):
    """
    Return the largest relative difference of two sets of windows, dicts by their end.

    Infinite where a window or a mode is missing in one of them.
    """
    if set(one) != set(other):
        return math.inf
    worst = 0.0
    for end in one:
        a, b = one[end].modes, other[end].modes
        if [m.identity for m in a] != [m.identity for m in b]:
            return math.inf
        for m, n in zip(a, b):
            for name in ('frequency_hz', 'damping_ratio'):
                x, y = getattr(m, name), getattr(n, name)
                worst = max(worst, abs(x - y) / abs(x))
    return worst
