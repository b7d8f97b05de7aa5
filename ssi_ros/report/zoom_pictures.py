"""The peaks that differ most, each enlarged: recorded, expected before, expected after."""
import math

import numpy as np

from ssi_ros.report.curves import density
from ssi_ros.report.parts import Picture
from ssi_ros.report.style import CORRECTED, grid, MODEL, RECORD

MOST = 6                # peaks that are enlarged
WIDTHS = 8.0            # half-power widths of a mode that a panel shows to each side, at least
BINS = 6                # and so many bins
CLEAR = 3.0             # standard deviations by which an effect must change a peak,
UNLIKE = 2.0            # and by which the bins of a record must differ from what is expected, rms


def peaks_that_differ(view):
    """
    Return the modes at which record and expectation differ most, those that differ at all.

    Parameters
    ----------
    view : GapView
        Its identified modes are looked at, and with an effect what the effect changes.

    Returns
    -------
    list of (float, slice, int)
        By rising frequency [Hz]: of the mode, the bins around it, the channel that differs most.

    """
    f, frame = view.frame.frequencies_hz, view.frame
    before = np.einsum('kii->ki', view.before.expected).real
    # what an effect changes has no scatter; without one the record itself is all there is
    other = np.einsum('kii->ki', view.record if view.after is None
                      else view.after.expected).real
    std = view.blur * math.sqrt(frame.inflation / frame.segments)
    df, found = float(f[1] - f[0]), []
    for m in view.window.modes:
        half = max(BINS * df, WIDTHS * max(m.damping_ratio, 0.0) * m.frequency_hz)
        inside = slice(*np.searchsorted(f, (m.frequency_hz - half, m.frequency_hz + half)))
        if inside.stop - inside.start < 3:
            continue
        change = np.log(other[inside] / before[inside])
        worth = np.sqrt(np.sum(change ** 2, axis=0)) / (
            std * math.sqrt(len(change)) if view.after is None else std)
        found.append((float(worth.max()), m.frequency_hz, inside, int(worth.argmax())))
    least = UNLIKE if view.after is None else CLEAR
    found = sorted((x for x in found if x[0] > least), reverse=True)
    kept = []
    for _, frequency_hz, inside, channel in found:
        # a peak near the middle of a panel is in it already
        if len(kept) < MOST and all(abs(frequency_hz - g) > 0.5 * df * (s.stop - s.start)
                                    for g, s, _ in kept):
            kept.append((frequency_hz, inside, channel))
    return sorted(kept, key=lambda peak: peak[0])


def zooms(view):
    """Return a Picture of the peaks that differ most, in a tuple; an empty one if none does."""
    peaks = peaks_that_differ(view)
    if not peaks:
        return ()
    columns = min(3, len(peaks))
    rows = -(-len(peaks) // columns)
    made = grid(rows, columns, 120 + 240 * rows,
                [f'{f:.3f} Hz at {view.channels[c]}' for f, _, c in peaks],
                vertical_spacing=0.24 / rows, horizontal_spacing=0.09)
    lines = [('recorded', RECORD, view.record), (view.nominal, MODEL, view.before.expected)]
    if view.after is not None:
        lines.append((view.better, CORRECTED, view.after.expected))
    for label, line, power in lines:
        level = density(power, view.frame.rate_hz).astype(np.float32)
        for i, (_, inside, channel) in enumerate(peaks):
            made.add_scatter(
                x=view.frame.frequencies_hz[inside].astype(np.float32),
                y=level[inside, channel], line=line, name=label, legendgroup=label,
                mode='lines', showlegend=i == 0, row=i // columns + 1, col=i % columns + 1)
    made.update_xaxes(nticks=5)
    made.update_xaxes(title_text='frequency [Hz]', row=rows)
    made.update_yaxes(type='log', exponentformat='power', dtick=1)
    made.update_yaxes(title_text='(m/s²)/√Hz', col=1)
    made.update_layout(legend={'y': 1.12})
    words = ('The peaks that the effect changes most' if view.after is not None
             else f'The peaks at which record and {view.nominal} differ most')
    return (Picture('zooms', made, f'{words}, each at the channel where the change is largest.',
                    least_px=260 * columns),)
