"""Frequency and damping of every identity over the windows, with spreads."""
import math

import numpy as np

from ssi_ros.identify.plot_style import caption, foot, heading, INK, panels

PANELS_MAX = 30          # the identities seen most often get a panel each
POINTS_MAX = 400         # more windows than these are thinned: a panel has no more pixels
STYLES = {'structural': {'marker': '.', 'markersize': 3},
          'undecided': {'marker': 'o', 'markersize': 3, 'fillstyle': 'none',
                        'markeredgewidth': 0.5},
          'input_line': {'marker': 'D', 'markersize': 4}}


def thinned(windows):
    """Return every k-th window, the last one always among them, at most `POINTS_MAX`."""
    step = -(-len(windows) // POINTS_MAX)
    return windows[(len(windows) - 1) % step::step]


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


def values_of(modes, what):
    """Return values and standard deviations of modes: 'frequency' in Hz or 'damping' in %."""
    if what == 'frequency':
        return [m.frequency_hz for m in modes], [m.frequency_std_hz for m in modes]
    return ([100.0 * m.damping_ratio for m in modes],
            [100.0 * m.damping_ratio_std for m in modes])


def tracks(windows, what):
    """Draw one panel an identity: 'frequency' or 'damping', one and two spreads wide."""
    found = histories(windows)
    every = [(w.end_ns - windows[0].end_ns) * 1e-9 for w in windows]
    columns = min(5, max(1, len(found)))
    rows = max(1, math.ceil(len(found) / columns))
    figure, axes = panels(rows, columns, (2.0, 1.25), (0.55, 0.4), sharex=True)
    for ax, (identity, history) in zip(axes, found.items()):
        _panel(ax, history, every, what)
        caption(ax, f'{identity}: {history[-1][1].frequency_hz:.3f} Hz')
        ax.locator_params(nbins=4)
        ax.ticklabel_format(useOffset=False)
        ax.tick_params(labelsize=7)
    for k, ax in enumerate(axes):
        if k >= len(found):
            ax.set_axis_off()
        elif k + columns >= len(found):       # the lowest panel of its column has the times
            ax.tick_params(labelbottom=True)
    foot(figure, 'time since the end of the first window [s]')
    unit = 'Hz' if what == 'frequency' else '%'
    text = (f'{what.capitalize()} [{unit}] of every identity with one and two standard '
            'deviations\ndot: structural, ring: undecided, diamond: input line')
    heading(figure, text if found else f'No mode was found: {windows[-1].reason}')
    return figure


def _panel(ax, history, every, what):
    """Draw one identity; the band is open where the mode was missed."""
    times = np.array([t for t, _ in history])
    modes = [m for _, m in history]
    values, spreads = map(np.array, values_of(modes, what))
    middle, spread = np.full((2, len(every)), np.nan)
    place = {t: k for k, t in enumerate(every)}       # the clock may have jumped back
    at = [place[t] for t in times]
    middle[at], spread[at] = values, spreads
    for width, alpha in ((2.0, 0.15), (1.0, 0.25)):
        ax.fill_between(every, middle - width * spread, middle + width * spread, color=INK,
                        alpha=alpha, linewidth=0)
    if len(times) == 1:      # a band of no width is not seen
        ax.errorbar(times, values, spreads, color=INK, capsize=3)
    labels = np.array([m.label for m in modes])
    for label, style in STYLES.items():
        mine = labels == label
        ax.plot(times[mine], values[mine], color=INK, linestyle='', **style)
