"""Mode shapes at the channels, and whether they are real up to a phase."""
import math

import numpy as np

from ssi_ros.identify.plot_style import caption, heading, INK, panels
from ssi_ros.identify.shapes import collinearity, upright

MARKERS = 'osD^v<>pPXhd8*'


def complex_plane(window, names):
    """Draw the components of every shape as arrows; those of a sound mode lie on one line."""
    count = len(window.modes)
    columns = min(6, max(1, count))
    rows = max(1, math.ceil(count / columns))
    figure, axes = panels(rows, columns, (1.45, 1.45), (0.35, 0.7), (0.4, 0.15, 0.8, 0.75))
    for ax, mode in zip(axes, window.modes):
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
        caption(ax, f'{mode.frequency_hz:.3f} Hz\n'
                f'collinear {collinearity(mode.shape[None])[0]:.3f}')
    for ax in axes[count:]:
        ax.set_axis_off()
    legend = [axes[0].plot([], [], MARKERS[k % len(MARKERS)], color=INK, fillstyle='none',
                           linestyle='', label=name)[0] for k, name in enumerate(names)]
    figure.legend(handles=legend, loc='lower center', ncols=min(8, len(names)), fontsize=8)
    heading(figure, 'Shapes of the last window in the complex plane' if count
            else f'No mode was found: {window.reason}')
    return figure


def shapes_at_channels(window, names):
    """Draw the real part of every shape at the channels: a colour and its number."""
    modes = window.modes
    table = np.array([upright(m.shape).real for m in modes]).reshape(len(modes), len(names))
    figure, (ax,) = panels(1, 1, (1.1 * max(2, len(names)), 0.27 * max(1, len(modes))),
                           margin=(1.0, 0.2, 0.5, 1.0))
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
    heading(figure, 'Real part of the shapes, largest component 1' if modes
            else f'No mode was found: {window.reason}')
    return figure
