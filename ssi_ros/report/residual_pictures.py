"""Residuals of a calibrated model over the time of every recording."""
import numpy as np

from ssi_ros.report.parts import Picture, Section
from ssi_ros.report.style import CORRECTED, grid, MODEL


def residual_section(names, pairs):
    """
    Return the section of a page on when the recordings differ from a calibrated model.

    Parameters
    ----------
    names : sequence of str
        Of the recordings.
    pairs : sequence of (GapView, GapView)
        Of every recording beside the model as it was and beside the calibrated one.

    Returns
    -------
    Section

    """
    return Section(
        'When do the recordings differ from the model?',
        ('The power of every segment over what the model expects of it, the mean of all bins and '
         'channels: 1 where the model is right. A segment far above 1 holds an event that the '
         'model lacks; a rise or fall over a recording is a level or a mode that drifts.',),
        pictures=(residuals(names, pairs),))


def residuals(names, pairs):
    """Draw the residual of every segment, a row a recording, before and after."""
    count = len(pairs)
    made = grid(count, 1, 130 + 170 * count, names, vertical_spacing=0.3 / count)
    for row, views in enumerate(pairs, 1):
        for view, label, line in zip(views, ('model', 'calibrated model'), (MODEL, CORRECTED)):
            frame = view.frame
            made.add_scatter(
                x=(np.asarray(frame.begins_s) + 0.5 * frame.rows / frame.rate_hz).astype(
                    np.float32),
                y=view.before.whitened.mean(axis=1).astype(np.float32), line=line,
                mode='lines+markers', name=label, legendgroup=label, showlegend=row == 1,
                row=row, col=1)
        made.add_hline(1.0, line_width=0.8, row=row, col=1)
    made.update_yaxes(title_text='power over expected', type='log')
    made.update_xaxes(title_text='time since the first sample [s]', row=count, col=1)
    return Picture('calibration_residuals', made,
                   'Residuals over time, a point a segment at its middle. Dashed: the model as it '
                   'was; bold: calibrated on all the recordings together.')
