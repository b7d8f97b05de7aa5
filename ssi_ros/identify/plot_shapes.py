"""Mode shapes at the channels, and whether they are real up to a phase."""
import math

import numpy as np

from ssi_ros.identify.shapes import collinearity, upright

INK = '#173f5f'
MARKERS = 'osD^v<>pPXhd8*'


def complex_plane(window, names):
    """Draw the components of every shape as arrows; those of a sound mode lie on one line."""
    from matplotlib.figure import Figure
    count = len(window.modes)
    columns = min(6, max(1, count))
    rows = max(1, math.ceil(count / columns))
    figure = Figure(figsize=(1.9 * columns + 0.3, 2.1 * rows + 0.9), layout='constrained')
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax, mode in zip(axes.flat, window.modes):
        shape = upright(mode.shape)
        for k, z in enumerate(shape):
            ax.plot([0.0, z.real], [0.0, z.imag], color=INK, linewidth=0.9)
            ax.plot(z.real, z.imag, MARKERS[k % len(MARKERS)], color=INK, markersize=5,
                    fillstyle='none')
        ax.set(xlim=(-1.25, 1.25), ylim=(-1.25, 1.25), aspect='equal', xticks=[-1, 0, 1],
               yticks=[-1, 0, 1])
        ax.axhline(0.0, color='#bdbdbd', linewidth=0.5, zorder=0)
        ax.axvline(0.0, color='#bdbdbd', linewidth=0.5, zorder=0)
        ax.tick_params(labelsize=6)
        ax.set_title(f'{mode.frequency_hz:.3f} Hz\n'
                     f'collinear {collinearity(mode.shape[None])[0]:.3f}', fontsize=8)
    for ax in list(axes.flat)[count:]:
        ax.set_axis_off()
    legend = [axes.flat[0].plot([], [], MARKERS[k % len(MARKERS)], color=INK, fillstyle='none',
                                linestyle='', label=name)[0] for k, name in enumerate(names)]
    figure.legend(handles=legend, loc='outside lower center', ncols=min(8, len(names)),
                  fontsize=8)
    figure.suptitle('Shapes of the last window in the complex plane' if count
                    else f'No mode was found: {window.reason}', fontsize=10)
    return figure


def shapes_at_channels(window, names):
    """Draw the real part of every shape at the channels: a colour and its number."""
    from matplotlib.figure import Figure
    modes = window.modes
    table = np.array([upright(m.shape).real for m in modes]).reshape(len(modes), len(names))
    figure = Figure(figsize=(2.6 + 0.9 * len(names), 1.6 + 0.27 * max(1, len(modes))),
                    layout='constrained')
    ax = figure.subplots()
    if modes:
        ax.imshow(table, cmap='PuOr', vmin=-1.3, vmax=1.3, aspect='auto')
    for row, mode in enumerate(modes):
        for k, value in enumerate(table[row]):
            spread = mode.shape_std[k]
            text = f'{value:+.2f}' + (f' ± {spread:.2f}' if math.isfinite(spread) else '')
            ax.text(k, row, text, ha='center', va='center', fontsize=7.5,
                    color='white' if abs(value) > 0.75 else 'black')
    ax.set_xticks(range(len(names)), [n.rsplit('/', 1)[-1] for n in names], rotation=30,
                  fontsize=8)
    ax.set_yticks(range(len(modes)), [f'{m.frequency_hz:.3f} Hz' for m in modes], fontsize=8)
    ax.set_title('Real part of the shapes, largest component 1' if modes
                 else f'No mode was found: {window.reason}')
    return figure
