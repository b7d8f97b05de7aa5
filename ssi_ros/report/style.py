"""How every picture looks: dashes, widths and markers first, colour only in addition."""
INK, GREY = '#173f5f', '#8a8a8a'
RECORD = {'color': GREY, 'width': 1.0}
MODEL = {'color': INK, 'width': 1.6, 'dash': 'dash'}
CORRECTED = {'color': '#b8600b', 'width': 2.0, 'dash': 'dot'}
DIVERGING = 'PuOr'          # purple to orange: distinct without colour vision


def figure(height, **layout):
    """Return an empty Plotly figure in the common style."""
    import plotly.graph_objects as go
    return go.Figure(layout=_layout(height) | layout)


def grid(rows, columns, height, titles=(), **options):
    """Return an empty figure of several panels."""
    from plotly.subplots import make_subplots
    made = make_subplots(rows, columns, subplot_titles=titles or None, **options)
    made.update_layout(_layout(height))
    if titles:              # below the buttons of Plotly
        made.update_layout(height=height + 24, margin={'t': 64})
    made.update_annotations(font_size=12)
    return made


def upright_lines(made, lines):
    """
    Draw lines over the whole height of panels, all at once: one by one Plotly takes 30 ms each.

    Parameters
    ----------
    made : plotly.graph_objects.Figure
        Without other shapes.
    lines : sequence of (float, int, str or None)
        Where on the axis, the number of the panel from 1 on, row by row, and the dash.

    """
    made.update_layout(shapes=[
        {'line': {'color': INK, **({'dash': dash} if dash else {}), 'width': 0.8}, 'type': 'line',
         'x0': x, 'x1': x, 'xref': f'x{number}', 'y0': 0, 'y1': 1, 'yref': f'y{number} domain'}
        for x, panel, dash in lines for number in ['' if panel == 1 else panel]])


def _layout(height):
    return {'template': 'simple_white', 'height': height, 'font': {'size': 13},
            'margin': {'l': 70, 'r': 20, 't': 40, 'b': 50},
            'legend': {'orientation': 'h', 'y': 1.0, 'yanchor': 'bottom', 'x': 0.0}}


def bars(names, values, texts, title, *, low=None, high=None, limit=1.0, ticks='.0%'):
    """Return horizontal bars, the first on top, each with its number; optional intervals."""
    made = figure(90 + 30 * len(names), title={'text': title, 'font': {'size': 14}},
                  showlegend=False)
    error = None
    if low is not None:
        error = {'type': 'data', 'symmetric': False, 'thickness': 1.5,
                 'array': [max(h - v, 0.0) for h, v in zip(high, values)],
                 'arrayminus': [max(v - w, 0.0) for w, v in zip(low, values)]}
    made.add_bar(x=list(values), y=list(names), orientation='h', error_x=error, hoverinfo='skip',
                 marker={'color': '#c9d3da', 'line': {'color': INK, 'width': 1.2}}, width=0.6)
    places = [max(v, 0.0) if high is None else max(v, h, 0.0) for v, h in zip(
        values, high or values)]
    made.add_scatter(x=places, y=list(names), mode='text', text=[f' {t}' for t in texts],
                     textposition='middle right', hoverinfo='skip', cliponaxis=False)
    least = min([0.0, *values])
    # room for the numbers on the right
    made.update_xaxes(range=[1.05 * least, 1.35 * max(limit, *places, 1e-12)], tickformat=ticks,
                      zeroline=True)
    made.update_yaxes(autorange='reversed', automargin=True, type='category')
    return made


def heat(z, x, y, title, *, x_title='', unit='', limit=None, height=None, texts=None):
    """Return a map of signed numbers with its scale beside it; `texts` go into its fields."""
    made = figure(height or 160 + 34 * len(y), title={'text': title, 'font': {'size': 14}})
    made.add_heatmap(z=z, x=x, y=list(y), colorscale=DIVERGING, zmin=-limit, zmax=limit, zmid=0.0,
                     text=texts, texttemplate='%{text}' if texts is not None else None,
                     colorbar={'title': {'text': unit}, 'thickness': 14})
    made.update_xaxes(title_text=x_title)
    made.update_yaxes(autorange='reversed', automargin=True)
    return made
