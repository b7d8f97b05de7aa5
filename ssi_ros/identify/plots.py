"""
Pictures of an identification: PNG and SVG to print. The page to look into is `report`'s.

Colours are only ever a second sign: markers, numbers and positions tell the same without them.
"""
from pathlib import Path

import numpy as np

from ssi_ros.identify.plot_shapes import complex_plane, shapes_at_channels
from ssi_ros.identify.plot_stability import singular_values, stabilisation
from ssi_ros.identify.plot_style import PLAIN
from ssi_ros.identify.plot_tracks import thinned, tracks
from ssi_ros.whole_file import whole_path

FIGURES = {
    'stabilisation': lambda windows, names, spectrum: stabilisation(windows[-1], spectrum),
    'singular_values': lambda windows, names, spectrum: singular_values(windows[-1]),
    'tracks_frequency': lambda windows, names, spectrum: tracks(windows, 'frequency'),
    'tracks_damping': lambda windows, names, spectrum: tracks(windows, 'damping'),
    'complex_plane': lambda windows, names, spectrum: complex_plane(windows[-1], names),
    'shapes': lambda windows, names, spectrum: shapes_at_channels(windows[-1], names),
}


def write_plots(windows, folder, names, spectrum=None):
    """
    Write the pictures of an identification.

    Parameters
    ----------
    windows : sequence of WindowModes
        By rising time; the last one is shown in detail.
    folder : path
        Made where it does not exist.
    names : sequence of str
        Of the channels.
    spectrum : tuple of ndarray, optional
        That of the last window, of `spectrum_of`, shown behind its poles.

    Returns
    -------
    list of Path
        NAME.png and NAME.svg for every figure.

    Raises
    ------
    ValueError
        Without windows.

    """
    if not windows:
        raise ValueError('no windows were given, so there is nothing to plot; identify a record '
                         'of at least one sample')
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    shown = thinned(windows)
    paths = []
    with rc_context(PLAIN):
        for name, draw in FIGURES.items():
            figure = draw(shown, names, spectrum)
            FigureCanvasAgg(figure)
            for end in ('png', 'svg'):
                paths.append(folder / f'{name}.{end}')
                with whole_path(paths[-1]) as draft:
                    figure.savefig(draft, dpi=130)
    return paths


def spectrum_of(window, stamps_ns, values, rate_hz, segments=6):
    """
    Return the mean spectrum of all channels in a window, or None without samples.

    Averaged over half-overlapping Hann segments (Welch); every channel is scaled to unit
    variance first, a missing sample counts as 0.

    Returns
    -------
    frequency_hz, level_db : ndarray
        Level over 1/Hz [dB].

    """
    rows = rows_of(window, stamps_ns, values, rate_hz)
    size = 2 * len(rows) // (segments + 1)
    if size < 16 or not rows.shape[1]:
        return None
    total = np.zeros(size // 2 + 1)
    taper = np.hanning(size)
    for row in rows.T[~np.isnan(rows).all(axis=0)]:
        row = np.nan_to_num((row - np.nanmean(row)) / (np.nanstd(row) or 1.0))
        for first in range(0, len(row) - size + 1, max(1, size // 2)):
            total += np.abs(np.fft.rfft(taper * row[first:first + size])) ** 2
    frequency = np.fft.rfftfreq(size, 1.0 / rate_hz)
    level = total / (rate_hz * (taper ** 2).sum())
    return frequency[1:], 10.0 * np.log10(np.maximum(level[1:], 1e-30))


def rows_of(window, stamps_ns, values, rate_hz):
    """Return the samples in a window as even rows (n, l), NaN where one is missing."""
    rows = np.full((round((window.end_ns - window.start_ns) * 1e-9 * rate_hz), len(values)),
                   np.nan)
    for column, stamps, samples in zip(rows.T, stamps_ns, values):
        at = np.rint((np.asarray(stamps) - window.start_ns) * 1e-9 * rate_hz).astype(np.int64)
        samples = np.asarray(samples, dtype=float)
        inside = (at >= 0) & (at < len(rows)) & (np.abs(samples) < 1e100)
        column[at[inside]] = samples[inside]
    return rows
