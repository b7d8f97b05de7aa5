"""Frequency and damping of every identity over the windows, with spreads."""
import math

import numpy as np

PANELS_MAX = 30          # the identities seen most often get a panel each
INK = '#173f5f'
MARKS = {'structural': 'o', 'undecided': 'o', 'input_line': 'D'}


def histories(windows):
    """
    Return the modes by identity.

    Returns
    -------
    dict of int to list of (float, Mode)
        Seconds from the first window's end, and the mode, by rising mean frequency.

    """
    found = {}
    for w in windows:
        for m in w.modes:
            found.setdefault(m.identity, []).append(((w.end_ns - windows[0].end_ns) * 1e-9, m))
    often = sorted(found.items(), key=lambda item: -len(item[1]))[:PANELS_MAX]
    return dict(sorted(often, key=lambda item: item[1][-1][1].frequency_hz))


def tracks(windows, what):
    """Draw one panel an identity: 'frequency' or 'damping', one and two spreads wide."""
    from matplotlib.figure import Figure
    found = histories(windows)
    columns = min(5, max(1, len(found)))
    rows = max(1, math.ceil(len(found) / columns))
    figure = Figure(figsize=(2.5 * columns + 0.5, 1.75 * rows + 0.9), layout='constrained')
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True)
    unit = 'Hz' if what == 'frequency' else '%'
    for ax, (identity, history) in zip(axes.flat, found.items()):
        times = [t for t, _ in history]
        modes = [m for _, m in history]
        if what == 'frequency':
            values = [m.frequency_hz for m in modes]
            spreads = [m.frequency_std_hz for m in modes]
        else:
            values = [100.0 * m.damping_ratio for m in modes]
            spreads = [100.0 * m.damping_ratio_std for m in modes]
        here = dict(zip(times, zip(values, spreads)))
        every = [(w.end_ns - windows[0].end_ns) * 1e-9 for w in windows]
        middle, spread = np.array([here.get(t, (np.nan, np.nan)) for t in every]).T
        for width, alpha in ((2.0, 0.15), (1.0, 0.25)):       # open where the mode was missed
            ax.fill_between(every, middle - width * spread, middle + width * spread, color=INK,
                            alpha=alpha, linewidth=0)
        if len(times) == 1:      # a band of no width is not seen
            ax.errorbar(times, values, spreads, color=INK, capsize=3)
        for t, v, m in zip(times, values, modes):
            ax.plot(t, v, MARKS[m.label], color=INK, markersize=3,
                    fillstyle='none' if m.label == 'undecided' else 'full')
        ax.set_title(f'{identity}: {modes[-1].frequency_hz:.3f} Hz')
        ax.ticklabel_format(useOffset=False)
        ax.tick_params(labelsize=7)
    for ax in list(axes.flat)[len(found):]:
        ax.set_axis_off()
    figure.supxlabel('time since the end of the first window [s]', fontsize=9)
    figure.supylabel(f'{what} [{unit}]', fontsize=9)
    text = (f'{what.capitalize()} of every identity with one and two standard deviations\n'
            'full: structural, open: undecided, diamond: input line')
    figure.suptitle(text if found else f'No mode was found: {windows[-1].reason}', fontsize=10)
    return figure
