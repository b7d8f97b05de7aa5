"""Pictures of an identification: stabilisation, tracks with spreads, shapes at the channels."""
import math

import numpy as np

from ssi_ros.gap.selection.localisation import name_by_sides
from ssi_ros.identify.plot_stability import accepted, shown
from ssi_ros.identify.shapes import upright
from ssi_ros.quantity import fixed, with_spread
from ssi_ros.report.parts import Picture, Table
from ssi_ros.report.style import figure, grid, heat, INK, upright_lines

CLOSE = 0.05            # relative distance within which neighbours get a panel of their own
PANELS = 24             # of tracks; the identities found most often
KINDS = (               # (words of a pole's reason, legend, marker, colour)
    ('only from order', 'beyond the significant orders', 'triangle-up-open', '#b8860b'),
    ('orders;', 'not in enough orders', 'x-thin-open', '#8c8c8c'),
    ('spread', 'spread too wide', 'square-open', '#7b6fa8'),
    ('collinear', 'shape not collinear', 'diamond-open', '#5b8c5a'),
    ('damping', 'damping out of range', 'cross-thin-open', '#b05a5a'),
    ('', 'another reason', 'circle-open', '#9a9a9a'))


def motion_of(shape, channels):
    """Return the name of a motion such as 'symmetric bending'; '' for other channels than ours."""
    name = name_by_sides(upright(np.asarray(shape)).real, channels)
    if name == 'mode':
        return ''
    return name.partition(' ')[2] if '/' in name else name      # of both arrays, or of one


def mode_table(window, pairs=None, channels=()):
    """Return the modes of a window as a table, beside the model's where pairs are given."""
    motions = [motion_of(m.shape, channels) for m in window.modes]
    named = ['motion'] if any(motions) else []
    # what a narrow screen shows stands first
    heads = ['mode', 'frequency [Hz]', 'damping [%]', *named, 'label']
    heads += ['model [Hz]', 'error [%]', 'model damping [%]', 'MAC'] if pairs is not None else []
    rows, numbers = [], numbered(window)
    for i, m in sorted(enumerate(window.modes), key=lambda item: item[1].frequency_hz):
        row = [numbers[m.identity], with_spread(m.frequency_hz, m.frequency_std_hz, 4, '±'),
               with_spread(100 * m.damping_ratio, 100 * m.damping_ratio_std, 2, '±'),
               *([motions[i]] if named else []), m.label]
        if pairs is not None:
            p = pairs[i]
            row += ['-'] * 4 if p is None else [
                f'{p.frequency_hz:.4f}',
                fixed(100 * (p.frequency_hz / m.frequency_hz - 1), 3, '+'),
                f'{100 * p.damping_ratio:.2f}', f'{p.mac:.3f}']
        rows.append((*row, m.identity))
    words = ('Modes of the last window by frequency, ± one standard deviation. Id: what messages, '
             'files and the terminal call the mode')
    if pairs is not None:
        words += ('. Error: frequency of the model, less that identified, over that identified; '
                  '- where the model has no mode of like frequency and shape. '
                  'MAC: modal assurance criterion of the two shapes, 1 = the same')
    return Table((*heads, 'id'), tuple(rows), words)


def numbered(window):
    """Return the numbers of a window's modes by rising frequency, from 1, by identity."""
    ranked = sorted(window.modes, key=lambda m: m.frequency_hz)
    return {m.identity: k + 1 for k, m in enumerate(ranked)}


def notes(window):
    """Return what was noted of single modes of a window, in sentences."""
    numbers, found = numbered(window), {}
    for m in sorted(window.modes, key=lambda m: m.frequency_hz):
        if m.note:
            found.setdefault((m.label, m.note), []).append(str(numbers[m.identity]))
    return tuple(f'Mode{"s" * (len(own) > 1)} {", ".join(own)}: {label.replace("_", " ")}, {note}.'
                 for (label, note), own in found.items())


def name_of(window, mode):
    """Return what a mode of a window is called on a page: number by frequency, and frequency."""
    return f'mode {numbered(window)[mode.identity]}: {mode.frequency_hz:.3f} Hz'


def stabilisation(window, frequencies_hz=None, level=None, unit='(m/s²)/√Hz', pick=False):
    """
    Draw the poles of all orders, which became modes, and why the others did not.

    Parameters
    ----------
    window : WindowModes
        Identified.
    frequencies_hz, level : ndarray, shape (k,), optional
        Mean spectrum of the channels, an amplitude.
    unit : str
        Of the spectrum.
    pick : bool
        Whether a click on a pole picks it, see `page.js`.

    Returns
    -------
    Picture

    """
    made = figure(560)
    if level is not None:
        made.add_scatter(x=frequencies_hz.astype(np.float32), y=level.astype(np.float32),
                         yaxis='y2', mode='lines', line={'color': '#b5b5b5', 'width': 1},
                         name='spectrum', hoverinfo='skip')
    rejected = shown(window)
    for words, legend, marker, colour in KINDS:
        poles = [p for p in rejected
                 if next(k[0] for k in KINDS if k[0] in p.reason) == words]
        if poles:
            _poles(made, poles, f'rejected: {legend}', marker, colour)
    _poles(made, accepted(window), 'pole of a mode', 'circle', INK)
    upright_lines(made, [(m.frequency_hz, 1, 'solid' if m.label == 'structural' else 'dash')
                         for m in window.modes])
    made.update_layout(
        xaxis={'title': {'text': 'frequency [Hz]'}, 'type': 'log'},
        yaxis={'title': {'text': 'model order'}},
        yaxis2={'overlaying': 'y', 'side': 'right', 'showgrid': False, 'type': 'log',
                'title': {'text': f'mean spectrum [{unit}]'}, 'exponentformat': 'power',
                'dtick': 1},
        legend={'y': -0.15, 'yanchor': 'top'}, margin={'b': 120, 'r': 90})
    return Picture('stabilisation', made,
                   'Poles of all model orders in the last window. Filled circles became modes '
                   '(lines; dashed where the label is not structural). Point at any other marker '
                   'for the reason why it was rejected. Each band of frequencies is identified by '
                   'itself, with orders of its own, so its modes begin at the order that the band '
                   'needs.' + (' A click on a pole picks it, another one lets it go.' if pick
                               else ''), {'pick': len(made.data)} if pick else None,
                   least_px=640)


def close_modes(window):
    """Draw the poles of neighbouring modes so near that the diagram shows one; none without."""
    groups = []
    for m in sorted(window.modes, key=lambda m: m.frequency_hz):
        if groups and m.frequency_hz < (1 + CLOSE) * groups[-1][-1].frequency_hz:
            groups[-1].append(m)
        else:
            groups.append([m])
    groups = [g for g in groups if len(g) > 1]
    if not groups:
        return ()
    numbers = numbered(window)
    columns = min(4, len(groups))
    rows = math.ceil(len(groups) / columns)
    titles = ['modes ' + ', '.join(str(numbers[m.identity]) for m in g) for g in groups]
    made = grid(rows, columns, 100 + 220 * rows, titles, vertical_spacing=0.3 / rows,
                horizontal_spacing=0.06)
    poles = accepted(window)
    for k, group in enumerate(groups):
        place = {'row': k // columns + 1, 'col': k % columns + 1}
        low, high = group[0].frequency_hz, group[-1].frequency_hz
        edge = 0.5 * (high - low)
        inside = [p for p in poles if low - edge <= p.frequency_hz <= high + edge]
        made.add_scatter(x=[p.frequency_hz for p in inside], y=[p.order for p in inside],
                         mode='markers', marker={'color': INK, 'size': 6}, showlegend=False,
                         **place)
        made.update_xaxes(range=[low - edge, high + edge], nticks=4, **place)
    upright_lines(made, [(m.frequency_hz, k, None) for k, group in enumerate(groups, 1)
                         for m in group])
    made.update_xaxes(title_text='Hz', row=rows)
    made.update_yaxes(title_text='model order', col=1)
    return (Picture('close_modes', made, 'The same poles where modes are within '
                    f'{100 * CLOSE:g} % of their neighbours, each group on its own axis.',
                    least_px=230 * columns),)


def _poles(made, poles, name, marker, colour):
    made.add_scatter(
        x=[round(p.frequency_hz, 5) for p in poles], y=[p.order for p in poles], mode='markers',
        name=name, marker={'symbol': marker, 'color': colour, 'size': 7},
        customdata=[(p.frequency_hz, p.damping_ratio, p.order) for p in poles],
        text=[f'{p.frequency_hz:.4f} Hz, damping {100 * p.damping_ratio:.2f} %, order {p.order}'
              + (f'<br>{p.reason}' if p.reason else '') for p in poles], hoverinfo='text')


def tracks(windows, what):
    """Draw 'frequency' or 'damping' of every identity over the windows, with its spread."""
    found = {}
    for w in windows:
        for m in w.modes:
            found.setdefault(m.identity, []).append(((w.end_ns - windows[0].start_ns) * 1e-9, m))
    often = sorted(found.items(), key=lambda i: -len(i[1]))[:PANELS]
    often.sort(key=lambda item: item[1][-1][1].frequency_hz)
    columns = min(4, len(often))
    rows = math.ceil(len(often) / columns)
    numbers = numbered(windows[-1])
    titles = [(f'mode {numbers[i]}' if i in numbers else 'gone')
              + f': {h[-1][1].frequency_hz:.3f} Hz' for i, h in often]
    made = grid(rows, columns, 100 + 150 * rows, titles, shared_xaxes=True,
                vertical_spacing=0.32 / rows, horizontal_spacing=0.06)
    for k, (_, history) in enumerate(often):
        t = np.array([s for s, _ in history])
        value, std = _series([m for _, m in history], what)
        place = {'row': k // columns + 1, 'col': k % columns + 1}
        made.add_scatter(x=np.concatenate([t, t[::-1]]),
                         y=np.concatenate([value + std, (value - std)[::-1]]), fill='toself',
                         fillcolor='rgba(23,63,95,0.18)', line={'width': 0}, hoverinfo='skip',
                         mode='lines', showlegend=False, **place)
        made.add_scatter(x=t, y=value, mode='lines+markers', line={'color': INK, 'width': 1},
                         marker={'size': 4, 'symbol': [
                             'circle' if m.label == 'structural' else 'circle-open'
                             for _, m in history]}, showlegend=False, **place)
    made.update_xaxes(rangemode='tozero')
    made.update_xaxes(title_text='s', row=rows)
    made.update_yaxes(tickfont_size=10, nticks=4)
    unit = 'Hz' if what == 'frequency' else '%'
    return Picture(f'tracks_{what}', made,
                   f'{what.capitalize()} [{unit}] of each identity over the windows, in seconds '
                   'from the start of the record '
                   'to the end of the window; the band is one standard deviation. Filled: '
                   'structural, open: undecided or a line of the excitation.',
                   least_px=230 * columns)


def _series(modes, what):
    if what == 'frequency':
        return (np.array([m.frequency_hz for m in modes]),
                np.nan_to_num([m.frequency_std_hz for m in modes]))
    return (np.array([100 * m.damping_ratio for m in modes]),
            np.nan_to_num([100 * m.damping_ratio_std for m in modes]))


def shape_table(window, channels):
    """Draw the real part of every shape at the channels, with the number in each field."""
    modes = sorted(window.modes, key=lambda m: m.frequency_hz)
    shapes = np.array([upright(m.shape).real for m in modes])
    texts = [[_component(v, s) for v, s in zip(row, m.shape_std)]
             for row, m in zip(shapes, modes)]
    made = heat(np.round(shapes, 4), list(channels),
                [', '.join(filter(None, (name_of(window, m), motion_of(m.shape, channels))))
                 for m in modes],
                'Real part of the shapes, largest component 1', limit=1.0, texts=texts,
                height=150 + 26 * len(modes))
    return Picture('shapes', made, 'Components of each mode at the sensors, ± one standard '
                   'deviation where it is known.', least_px=200 + 90 * len(channels))


def _component(value, std):
    return fixed(value, 2, '+') + (f' ± {std:.2f}' if math.isfinite(std) else '')
