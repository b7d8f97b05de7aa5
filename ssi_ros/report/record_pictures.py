"""Pictures of what was recorded: time histories thinned by least and greatest, spectra."""
import numpy as np

from ssi_ros.report.curves import density
from ssi_ros.report.parts import Picture
from ssi_ros.report.style import CORRECTED, grid, INK, MODEL, RECORD

COLUMNS = 1200          # of a thinned history: about one a pixel


def thin(values, columns=COLUMNS):
    """
    Return the rows that keep the least and the greatest value of every column of a picture.

    Parameters
    ----------
    values : ndarray, shape (n,)
        One channel; NaN where a sample is missing.
    columns : int
        Columns of the picture.

    Returns
    -------
    ndarray of int, shape (m,)
        Rising; all rows where there are few. A missing row between two kept ones is kept too,
        so that a gap stays a gap.

    """
    n = len(values)
    if n <= 2 * columns:
        return np.arange(n)
    edges = np.linspace(0, n, columns + 1).astype(int)
    kept = []
    for first, last in zip(edges[:-1], edges[1:]):
        part = values[first:last]
        gone = np.isnan(part)
        if not gone.all():
            kept += [first + int(np.nanargmin(part)), first + int(np.nanargmax(part))]
        if gone.any():
            kept.append(first + int(np.argmax(gone)))
    return np.unique(kept)


def histories(samples):
    """Draw every channel over time."""
    made = grid(len(samples.channels), 1, 110 + 130 * len(samples.channels), samples.channels,
                shared_xaxes=True, vertical_spacing=0.18 / max(len(samples.channels), 1))
    for i, column in enumerate(samples.values.T):
        rows = thin(column)
        made.add_scatter(x=(rows / samples.rate_hz).astype(np.float32),
                         y=column[rows].astype(np.float32), line={'color': INK, 'width': 0.7},
                         mode='lines', showlegend=False, row=i + 1, col=1)
    made.update_yaxes(title_text='m/s²')
    made.update_xaxes(title_text='time since the first sample [s]', row=len(samples.channels),
                      col=1)
    each = max(1, len(samples.values) // COLUMNS)
    return Picture('histories', made,
                   'Accelerations. Thinned: of every '
                   f'{each} samples the least and the greatest are drawn, so no peak is lost; '
                   'a gap is a gap of the record.' if each > 2 else 'Accelerations, every sample.')


def spectra(channels, frame, record, model=None, corrected=None, name='spectra',
            nominal='model', better='model with the effect'):
    """
    Draw amplitude spectra of the record and what models expect.

    Parameters
    ----------
    channels : sequence of str
        Names.
    frame : Frame
        How the record was cut.
    record, model, corrected : ndarray, shape (k, l, l)
        Periodograms: recorded, expected of the model, expected of the model with the effect.
    name : str
        Of the picture.
    nominal, better : str
        What `model` is, 'model' or 'reference', and what `corrected` is.

    Returns
    -------
    Picture

    """
    columns = 2 if len(channels) > 1 else 1
    rows = -(-len(channels) // columns)
    made = grid(rows, columns, 120 + 270 * rows, channels, shared_xaxes=True, shared_yaxes=True,
                vertical_spacing=0.22 / rows, horizontal_spacing=0.04)
    f = frame.frequencies_hz.astype(np.float32)
    for label, line, power in (('recorded', RECORD, record), (nominal, MODEL, model),
                               (better, CORRECTED, corrected)):
        if power is None:
            continue
        level = density(power, frame.rate_hz).astype(np.float32)
        for i in range(len(channels)):
            made.add_scatter(x=f, y=level[:, i], line=line, mode='lines', name=label,
                             legendgroup=label, showlegend=i == 0, row=i // columns + 1,
                             col=i % columns + 1)
    made.update_xaxes(type='log')
    made.update_xaxes(title_text='frequency [Hz]', row=rows)
    made.update_yaxes(type='log', exponentformat='power')
    made.update_yaxes(title_text='(m/s²)/√Hz', col=1)
    made.update_layout(legend={'y': 1.06})
    text = ('Amplitude spectra, the mean of '
            f'{frame.segments} tapered segments of {frame.rows / frame.rate_hz:g} s. '
            'Thin and solid: recorded')
    if model is not None and nominal == 'reference':
        text += '; dashed: the reference recording, scaled to the level of this one'
    elif model is not None:
        text += ('; dashed: what the model expects of the same taper, its levels of excitation '
                 'and noise fitted')
    if corrected is not None:
        text += f'; dotted: the {better}'
    return Picture(name, made, text + '.', least_px=300 * columns)
