"""Modes of windows: those in a band, and one window as CSV or as a universal file."""
import csv
from dataclasses import replace
import math
from pathlib import Path

from ssi_ros.bag.export import pyuff_module, UNIVERSAL
from ssi_ros.whole_file import whole_file, whole_path

ENDS = ('.csv', *UNIVERSAL)


def parse_band(text):
    """Return LOW and HIGH [Hz] of 'LOW:HIGH'; one that is left out is no limit."""
    try:
        low, high = (float(part) if part else default
                     for part, default in zip(text.split(':'), (0.0, math.inf), strict=True))
    except ValueError:
        raise ValueError(f'--band {text} is not of the form LOW:HIGH, in Hz; such as 5:20') \
            from None
    if not 0.0 <= low < high:
        raise ValueError(f'--band {text}: LOW must be 0 or more, and HIGH above it')
    return low, high


def in_band(windows, low_hz, high_hz):
    """Return windows with the modes and poles between two frequencies alone."""
    def inside(items):
        return tuple(i for i in items if low_hz <= i.frequency_hz <= high_hz)
    out = []
    for w in windows:
        modes, reason = inside(w.modes), w.reason
        if w.modes and not modes:
            reason = f'no mode between {low_hz:g} and {high_hz:g} Hz'
        out.append(replace(w, modes=modes, rejected=inside(w.rejected), reason=reason))
    return tuple(out)


def scaled(recording, factor):
    """
    Return a recording whose values are multiplied, such as by 9.80665 from g to m/s^2.

    Raises
    ------
    ValueError
        If the factor is not a positive number.

    """
    if not 0.0 < factor < math.inf:
        raise ValueError(f'scale={factor:g} must be a positive number, such as 9.80665 for g')
    if factor == 1.0:
        return recording
    return replace(recording, values=tuple(factor * v for v in recording.values))


def check_modes(path):
    """Check that modes can be written to a file of that name, before the work."""
    if path is None:
        return
    if path.suffix.lower() not in ENDS:
        raise ValueError(f'--modes {path}: name a file that ends in ' + ' or '.join(ENDS))
    if path.suffix.lower() != '.csv':
        pyuff_module()


def write_modes(path, window, names):
    """
    Write the modes of a window.

    A CSV has one row a mode. A universal file has one data set 55 a mode (complex eigenvectors):
    node k is channel k, and its third component, z, is the shape there.

    Parameters
    ----------
    path : Path
        See `ENDS`.
    window : WindowModes
        Identified.
    names : sequence of str
        Of the channels.

    """
    path = Path(path)
    if path.suffix.lower() == '.csv':
        _write_csv(path, window, names)
        return
    pyuff = pyuff_module()
    with whole_path(path) as draft:         # a new one: the package appends
        pyuff.UFF(str(draft)).write_sets(
            [_set_55(m, k, names) for k, m in enumerate(window.modes, 1)], 'overwrite')


def _write_csv(path, window, names):
    heads = ['id', 'label', 'frequency_hz', 'frequency_std_hz', 'damping_ratio',
             'damping_ratio_std', *(f'{part}_{n}' for n in names for part in ('re', 'im'))]
    with whole_file(path, newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(heads)
        for m in window.modes:
            numbers = (m.frequency_hz, m.frequency_std_hz, m.damping_ratio, m.damping_ratio_std)
            writer.writerow([m.identity, m.label,
                             *(float(x) if math.isfinite(x) else '' for x in numbers),
                             *(part for z in m.shape.tolist() for part in (z.real, z.imag))])


def _set_55(mode, number, names):
    import numpy as np
    turn = 2.0 * math.pi * mode.frequency_hz
    decay = mode.damping_ratio * turn
    still = np.zeros(len(names), dtype=complex)
    return {'type': 55, 'id1': 'ssi_ros mode', 'id2': f'identity {mode.identity}, {mode.label}',
            'id3': ', '.join(names)[:80], 'id4': 'shape at the channels, largest component 1',
            'id5': 'NONE', 'model_type': 1, 'analysis_type': 3, 'data_ch': 2,
            'spec_data_type': 12, 'data_type': 5, 'n_data_per_node': 3,
            'r1': still, 'r2': still, 'r3': np.array(mode.shape),
            'node_nums': np.arange(1, len(names) + 1), 'load_case': 1, 'mode_n': number,
            'eig': complex(-decay, turn * math.sqrt(max(0.0, 1.0 - mode.damping_ratio ** 2))),
            'modal_a': 0j, 'modal_b': 0j}
