"""Write the channels of a recording to an NPZ, CSV or universal file."""
import csv
from pathlib import Path

import numpy as np

from ssi_ros.whole_file import whole_file, whole_path, write_arrays

UNIVERSAL = ('.uff', '.unv')
EVEN = 0.01             # of a sampling interval that stamps may be off


def export_recording(recording, path):
    """
    Write stamps and values of every channel.

    NPZ: for each channel <name>_stamps_ns and <name>_values. CSV: a column stamp_ns and one a
    channel, an empty cell where a channel has no message of that stamp. Universal file (needs
    pyuff): a data set 58 a channel, a time response with even abscissa from its first stamp;
    node k, direction z, is channel k.

    Raises
    ------
    ValueError
        If the file exists or its suffix is not known, two channels have one name, (CSV) a
        channel has two messages of one stamp, or (universal) samples are missing or uneven.

    """
    path = Path(path)
    names = recording.names
    check_export(path)
    if len(set(names)) != len(names):
        raise ValueError(f'two channels are named alike: {", ".join(names)}')
    if path.suffix == '.npz':
        arrays = {}
        for name, stamps, values in zip(names, recording.stamps_ns, recording.values):
            arrays[f'{name}_stamps_ns'], arrays[f'{name}_values'] = stamps, values
        write_arrays(path, compressed=True, **arrays)
        return
    if path.suffix in UNIVERSAL:
        _universal(recording, path)
        return
    rows = np.unique(np.concatenate(recording.stamps_ns))
    columns = []
    for name, stamps, values in zip(names, recording.stamps_ns, recording.values):
        cells = np.full(len(rows), '', dtype=object)
        at = np.searchsorted(rows, stamps)
        if len(np.unique(at)) != len(at):
            raise ValueError(f'{name} has two messages of one stamp, which a CSV cannot hold; '
                             'export to .npz')
        cells[at] = [repr(v) for v in values.tolist()]       # repr: reads back to the same bits
        columns.append(cells)
    with whole_file(path, newline='') as f:
        writer = csv.writer(f)
        writer.writerow(('stamp_ns', *names))
        writer.writerows(zip(rows.tolist(), *columns))


def check_export(path):
    """
    Check that channels can be written to a file of that name, before they are read.

    Raises
    ------
    ValueError
        If the file exists, its suffix is not known, or it needs pyuff, which is not there.

    """
    path = Path(path)
    if path.suffix not in ('.npz', '.csv', *UNIVERSAL):
        raise ValueError(f'{path}: give a name that ends in .npz, .csv, .uff or .unv')
    if path.exists():
        raise ValueError(f'{path} exists and is never overwritten; name another file')
    if path.suffix in UNIVERSAL:
        pyuff_module()


def pyuff_module():
    """Return pyuff; ValueError that says how to get it where it is not installed."""
    try:
        import pyuff
    except ImportError:
        raise ValueError('universal files need pyuff: pip install pyuff; or name a .csv') \
            from None
    return pyuff


def _universal(recording, path):
    """Write data sets 58."""
    pyuff, sets = pyuff_module(), []
    for number, (name, stamps, values) in enumerate(zip(
            recording.names, recording.stamps_ns, recording.values), 1):
        times = (stamps - stamps[0]) * 1e-9
        step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
        uneven = np.abs(times - step * np.arange(len(times))).max()
        if uneven > EVEN * step:
            raise ValueError(f'{name} is off even sampling at {1 / step:g} Hz by up to '
                             f'{uneven:.3g} s, samples missing or late, which a universal file '
                             'cannot hold; export to .csv or .npz')
        sets.append({
            'type': 58, 'binary': 0, 'func_type': 1, 'ver_num': 0, 'load_case_id': 0,
            'id1': name[:80], 'id2': f'first stamp {int(stamps[0])} ns', 'id3': 'NONE',
            'id4': 'NONE', 'id5': 'NONE', 'rsp_ent_name': 'NONE', 'rsp_node': number,
            'rsp_dir': 3, 'ref_ent_name': 'NONE', 'ref_node': 0, 'ref_dir': 0,
            'ord_data_type': 4, 'num_pts': len(values), 'abscissa_spacing': 1,
            'abscissa_min': 0.0, 'abscissa_inc': step, 'z_axis_value': 0.0,
            'abscissa_spec_data_type': 17, 'abscissa_axis_lab': 'time',
            'abscissa_axis_units_lab': 's', 'ordinate_spec_data_type': 12,
            'orddenom_spec_data_type': 0, 'z_axis_spec_data_type': 0,
            'data': np.asarray(values, dtype=float), 'x': step * np.arange(len(values))})
    with whole_path(path) as draft:         # a new one: the package appends
        pyuff.UFF(str(draft)).write_sets(sets, 'overwrite')
