"""Write the channels of a recording to an NPZ or CSV file."""
import csv
from pathlib import Path

import numpy as np

from ssi_ros.whole_file import whole_file


def export_recording(recording, path):
    """
    Write stamps and values of every channel.

    NPZ: for each channel <name>_stamps_ns and <name>_values. CSV: a column stamp_ns and one a
    channel, an empty cell where a channel has no message of that stamp.

    Raises
    ------
    ValueError
        If the file exists or its suffix is not known, two channels have one name, or (CSV) a
        channel has two messages of one stamp.

    """
    path = Path(path)
    names = recording.names
    if path.suffix not in ('.npz', '.csv'):
        raise ValueError(f'{path}: give a name that ends in .npz or .csv')
    if path.exists():
        raise ValueError(f'{path} exists and is never overwritten; name another file')
    if len(set(names)) != len(names):
        raise ValueError(f'two channels are named alike: {", ".join(names)}')
    if path.suffix == '.npz':
        arrays = {}
        for name, stamps, values in zip(names, recording.stamps_ns, recording.values):
            arrays[f'{name}_stamps_ns'], arrays[f'{name}_values'] = stamps, values
        with whole_file(path, 'wb') as f:
            np.savez_compressed(f, **arrays)
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
