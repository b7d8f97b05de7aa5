"""One interactive page of an identification that needs no network."""
import html

import numpy as np

from ssi_ros.identify.plot_stability import accepted, kind_of, shown
from ssi_ros.identify.plot_style import INK
from ssi_ros.identify.plot_tracks import histories, values_of
from ssi_ros.identify.shapes import collinearity, upright
from ssi_ros.quantity import with_spread

SYMBOLS = {'^': 'triangle-up', 'x': 'x', 's': 'square', 'D': 'diamond', '+': 'cross',
           '.': 'circle-open'}
# of the tracks: 24 lines that differ without colour
DASHES = ('solid', 'dash', 'dot', 'dashdot')
MARKS = ('circle', 'square', 'diamond', 'cross', 'triangle-up', 'x')
HEAD = ('<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<title>Identification</title><style>'
        'body{font-family:sans-serif;max-width:1200px;margin:1em auto;padding:0 1em}'
        'td,th{padding:2px 10px;text-align:right;white-space:nowrap}</style></head><body>'
        '<h1>Identification</h1>')


def page(windows, names, spectrum, total):
    """
    Return the page as text.

    Parameters
    ----------
    windows : sequence of WindowModes
        By rising time, thinned where there are very many.
    names : sequence of str
        Of the channels.
    spectrum : tuple of ndarray, or None
        Frequencies [Hz] and levels [dB] of the last window.
    total : int
        Windows before the thinning.

    Returns
    -------
    str

    """
    from plotly.io import to_html
    last = windows[-1]
    figures = [_stabilisation(last, spectrum), _tracks(windows, 'frequency'),
               _tracks(windows, 'damping')]
    if last.modes:
        figures.append(_shapes(last, names))
    thin = f', {len(windows)} of them in the tracks' if total > len(windows) else ''
    parts = [HEAD, f'<p>{total} windows of {len(names)} channels{thin}. '
             f'{html.escape(last.reason)}</p>', _table(last)]
    for k, figure in enumerate(figures):
        figure.update_layout(template='simple_white', font_size=12)
        parts.append('<div style="overflow-x:auto"><div style="min-width:800px">' + to_html(
            figure, full_html=False, include_plotlyjs=k == 0,
            config={'displaylogo': False, 'responsive': True}) + '</div></div>')
    return '\n'.join(parts) + '</body></html>'


def _table(window):
    rows = ['<div style="overflow-x:auto"><table><tr><th>identity</th><th>frequency [Hz]</th>'
            '<th>damping [%]</th><th>label</th></tr>']
    rows += [f'<tr><td>{m.identity}</td>'
             f'<td>{with_spread(m.frequency_hz, m.frequency_std_hz, 4, "±")}</td>'
             f'<td>{with_spread(100 * m.damping_ratio, 100 * m.damping_ratio_std, 3, "±")}</td>'
             f'<td>{m.label} {html.escape(m.note)}</td></tr>' for m in window.modes]
    return ''.join(rows) + '</table></div>'


def _stabilisation(window, spectrum):
    import plotly.graph_objects as go
    figure = go.Figure()
    if spectrum:
        figure.add_scatter(x=spectrum[0], y=spectrum[1], yaxis='y2', mode='lines',
                           line={'color': '#999999', 'width': 1}, name='spectrum [dB]',
                           hoverinfo='skip')
    groups = {}
    for p in shown(window):
        groups.setdefault(kind_of(p), []).append(p)
    for (legend, marker, colour), poles in groups.items():
        _poles(figure, poles, f'left out: {legend}', SYMBOLS[marker], colour)
    _poles(figure, accepted(window), 'pole of a mode', 'circle', INK)
    for mode in window.modes:
        figure.add_vline(mode.frequency_hz, line_width=0.7, line_color=INK,
                         line_dash='solid' if mode.label == 'structural' else 'dash')
    figure.update_layout(
        title='Poles of all orders in the last window: point at one for its reason',
        xaxis={'title': 'frequency [Hz]', 'type': 'log'}, yaxis={'title': 'model order'},
        yaxis2={'overlaying': 'y', 'side': 'right', 'title': 'spectrum [dB]', 'showgrid': False,
                'tickmode': 'auto'},
        legend={'orientation': 'h', 'y': -0.2}, height=600)
    return figure


def _poles(figure, poles, name, symbol, colour):
    figure.add_scatter(
        x=[p.frequency_hz for p in poles], y=[p.order for p in poles], mode='markers', name=name,
        marker={'symbol': symbol, 'color': colour, 'size': 7},
        text=[f'{p.frequency_hz:.4f} Hz, damping {100 * p.damping_ratio:.2f} %, order {p.order}'
              + (f'<br>{html.escape(p.reason)}' if p.reason else '') for p in poles],
        hoverinfo='text')


def _tracks(windows, what):
    import plotly.graph_objects as go
    figure = go.Figure()
    for k, (identity, history) in enumerate(histories(windows).items()):
        modes = [m for _, m in history]
        values, spreads = values_of(modes, what)
        figure.add_scatter(x=[t for t, _ in history], y=values, mode='lines+markers',
                           name=f'{identity}: {modes[-1].frequency_hz:.3f} Hz',
                           line_dash=DASHES[k % 4], marker_symbol=MARKS[k // 4 % 6],
                           error_y={'array': np.nan_to_num(spreads), 'thickness': 0.8})
    figure.update_layout(
        title=f'{what.capitalize()} over the windows, one standard deviation; a click in the '
        'legend hides an identity, a double click shows it alone',
        xaxis_title='time since the end of the first window [s]',
        yaxis={'title': f'{what} [{"Hz" if what == "frequency" else "%"}]',
               'type': 'log' if what == 'frequency' else 'linear'}, height=550)
    return figure


def _shapes(window, names):
    import plotly.graph_objects as go
    table = np.array([upright(m.shape).real for m in window.modes])
    labels = [f'{m.frequency_hz:.4f} Hz (collinear {collinearity(m.shape[None])[0]:.3f})'
              for m in window.modes]
    figure = go.Figure(go.Heatmap(z=table, x=list(names), y=list(range(len(labels))), zmid=0.0,
                                  colorscale='PuOr', text=np.round(table, 2),
                                  texttemplate='%{text}'))
    figure.update_layout(title='Real part of the shapes, largest component 1',
                         height=220 + 26 * len(labels),
                         yaxis={'tickvals': list(range(len(labels))), 'ticktext': labels})
    return figure
