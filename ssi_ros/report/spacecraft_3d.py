"""
Mode shapes on the spacecraft, in space and moving.

The surfaces are a mode of the model, turned and scaled to the identified shape; the dots are the
identified shape itself at the sensors. A sensor cannot say more than its own point, so where a
dot leaves its surface the model is wrong there.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.identify.shapes import upright
from ssi_ros.model import displacement_row, natural_modes
from ssi_ros.report.mode_pictures import motion_of
from ssi_ros.report.parts import Picture
from ssi_ros.report.style import figure, INK

ALONG, ACROSS = 17, 5       # points of a surface: bends of the tenth mode of an array show
PANEL = [[0.0, '#b35806'], [0.5, '#cfd8de'], [1.0, '#542788']]     # down, at rest, up
DEFLECTION = 0.12           # of the span, which a shape of 1 is drawn with


def shapes_picture(spacecraft, system, pairs):
    """
    Draw the identified modes on the spacecraft, and the model's modes that were not found.

    Parameters
    ----------
    spacecraft : Spacecraft
        Where arrays and sensors are.
    system : System
        Its model.
    pairs : sequence of Pair
        Identified modes and what they are, of `before_after.pair`.

    Returns
    -------
    Picture

    """
    grids = [_grid(a) for a in spacecraft.arrays]
    rows = [displacement_row(spacecraft, a.name, s, x)
            for a, (along, lateral) in zip(spacecraft.arrays, grids)
            for s, x in zip(along.ravel(), lateral.ravel())]
    count = len(rows)
    outputs = np.vstack([np.array(rows), system.sensor])
    fields = natural_modes(replace(system, sensor=outputs, channels=tuple(
        f'p{i}' for i in range(len(outputs))), conditioning=None, chain=())).shapes
    theory = natural_modes(system)
    span = max(a.root_m + a.plate.length_m for a in spacecraft.arrays)
    modes = []
    for i, frequency_hz in enumerate(theory.frequencies_hz):
        if frequency_hz > spacecraft.rate_hz / 2:
            break
        field, own = fields[:count, i], fields[count:, i]
        found = next((p for p in pairs if p and p.frequency_hz == frequency_hz), None)
        label, sensors = f'model {frequency_hz:.3f} Hz, not identified', None
        field = upright(field / np.abs(field).max())
        if found is not None:
            shape = upright(found.mode.shape)
            # least squares turns and scales the model's shape to the identified one
            field = fields[:count, i] * (np.vdot(own, shape) / np.vdot(own, own))
            largest = max(np.abs(field).max(), np.abs(shape).max())
            field, sensors = field / largest, _complex(shape / largest)
            motion = motion_of(shape, system.channels)
            label = (f'{found.mode.frequency_hz:.3f} Hz{motion and f" {motion}"} (model '
                     f'{frequency_hz:.3f} Hz, MAC {found.mac:.3f})')
        parts = np.split(field, len(grids))
        modes.append({'label': label, 'sensors': sensors, 'surfaces': [
            _complex(p.reshape(ALONG, ACROSS)) for p in parts]})
    modes.sort(key=lambda m: m['sensors'] is None)      # what was identified comes first
    made, surfaces, dots = _scene(spacecraft, grids, span)
    return Picture('shapes3d', made,
                   'Choose a mode; drag to turn. Surfaces: the mode of the model, fitted to the '
                   'identified shape. Dots: the identified shape at the sensors; crosses: the '
                   'sensors at rest. Where a dot leaves its surface the model is wrong.',
                   {'modes': modes, 'scale_m': DEFLECTION * span, 'surface_traces': surfaces,
                    'sensor_trace': dots})


def _grid(array):
    half = array.plate.width_m / 2
    return np.meshgrid(np.linspace(0, array.plate.length_m, ALONG),
                       np.linspace(-half, half, ACROSS), indexing='ij')


def _lines(low, high, count):
    return {'show': True, 'color': '#444444', 'width': 1, 'start': low, 'end': high,
            'size': (high - low) / count}


def _complex(values):
    return {'re': np.round(values.real, 4).tolist(), 'im': np.round(values.imag, 4).tolist()}


def _scene(spacecraft, grids, span):
    """Return the figure at rest, and the numbers of the traces that move."""
    made = figure(420, showlegend=False, margin={'l': 0, 'r': 0, 't': 10, 'b': 0})
    for a, (along, lateral) in zip(spacecraft.arrays, grids):
        made.add_surface(x=lateral, y=a.side * (a.root_m + along), z=0 * along,
                         surfacecolor=0 * along, colorscale=PANEL, cmin=-1, cmax=1,
                         showscale=False, hoverinfo='skip', contours={
                             'x': _lines(-a.plate.width_m / 2, a.plate.width_m / 2, 2),
                             'y': _lines(*sorted((a.side * a.root_m, a.side * (
                                 a.root_m + a.plate.length_m))), 8)})
    surfaces = list(range(len(grids)))
    x, y, z = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]).T
    faces = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                      (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]).T
    least = min(a.root_m for a in spacecraft.arrays) or 0.1 * span
    made.add_mesh3d(x=0.8 * least * x, y=0.9 * least * y, z=0.6 * least * z, i=faces[0],
                    j=faces[1], k=faces[2], color='#6d7a83', flatshading=True, hoverinfo='skip')
    places = [(spacecraft.array(s.array), s) for s in spacecraft.sensors]
    at_x = [s.lateral_m for _, s in places]
    at_y = [a.side * (a.root_m + s.along_m) for a, s in places]
    names = [s.name for _, s in places]
    made.add_scatter3d(x=at_x, y=at_y, z=[0.0] * len(names), mode='markers', hovertext=names,
                       hoverinfo='text', marker={'size': 3, 'color': 'black', 'symbol': 'cross'})
    made.add_scatter3d(x=at_x, y=at_y, z=[0.0] * len(names), mode='markers+text', text=names,
                       textposition='top center', hoverinfo='text',
                       marker={'size': 6, 'color': INK, 'line': {'color': 'white', 'width': 1}})
    reach = 1.6 * DEFLECTION * span
    width = max(a.plate.width_m for a in spacecraft.arrays) / 2
    ranges = {'xaxis': 1.3 * max(width, least), 'yaxis': 1.05 * span, 'zaxis': reach}
    titles = {'xaxis': 'x_b [m]', 'yaxis': 'y_b [m]', 'zaxis': ''}
    made.update_layout(scene={
        'aspectmode': 'manual',
        'aspectratio': {k[0]: 2.2 * r / ranges['yaxis'] for k, r in ranges.items()},
        'camera': {'eye': {'x': 1.5, 'y': 0.45, 'z': 0.7}},
        **{k: {'range': [-r, r], 'title': {'text': titles[k]}, 'nticks': 5, 'showgrid': False,
               'zeroline': False, 'showticklabels': k == 'yaxis', 'visible': k == 'yaxis'}
           for k, r in ranges.items()}})
    return made, surfaces, len(grids) + 2
