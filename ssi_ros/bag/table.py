"""Samples from a CSV, NPZ or MAT file; what does not fit is told, never mended."""
from array import array
import csv
from pathlib import Path

import numpy as np

from ssi_ros.array_file import arrays_of
from ssi_ros.limits import LIMITS
from ssi_ros.records import Samples

_OFF_GRID = 0.1       # of a period: a stamp further off is not of an even grid


def load_table(path, *, rate_hz=None, columns=None, variable=None, time_column=None, names=None,
               transpose=False, scale=1.0, start_s=1.0):
    """
    Read the columns of a file as samples on an even grid.

    An empty cell and `nan` are missing samples (NaN). Nothing else is mended.

    Parameters
    ----------
    path : str or Path
        .csv with a header, .npz, or .mat (version 5 or 7).
    rate_hz : float, optional
        Sampling rate [Hz]; needed without a time column.
    columns : sequence of str, optional
        Columns of a CSV, or one-dimensional variables of the others; all columns if not given.
    variable : str, optional
        A variable of shape (samples, channels); needed if there are several.
    time_column : str, optional
        Column or variable of times [s], or [ns] if its name ends in _ns; gives the rate and the
        stamps. A row that is missing from the grid becomes missing samples.
    names : sequence of str, optional
        Names of the channels; those of the columns if not given.
    transpose : bool
        The variable has one channel a row.
    scale : float
        Factor to m/s^2 (9.80665 for g).
    start_s : float
        Stamp of the first row [s since 1970] without a time column.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError
        Says what was found, what is allowed and what to do.

    """
    path = Path(path)
    if not (np.isfinite(scale) and scale):
        raise ValueError(f'scale={scale:g} must be a finite number other than 0, such as 9.80665 '
                         'for g')
    if not 0.0 <= start_s < 2 ** 31:
        raise ValueError(f'start_s={start_s:g} must be 0 to 2147483647 [s], the range of a ROS '
                         'time')
    if not path.is_file():
        raise ValueError(f'{path} does not exist or is not a file')
    if path.suffix.lower() == '.csv':
        if variable is not None:
            raise ValueError('a CSV file has no variables; pick its columns by name')
        found, values, time = _csv(path, columns, time_column)
    elif path.suffix.lower() in ('.npz', '.mat'):
        found, values, time = _variables(path, columns, variable, time_column, transpose)
    else:
        raise ValueError(f'{path}: {path.suffix or "no suffix"} is not known; '
                         'give a .csv, .npz or .mat')
    names = tuple(names or found)
    _check_columns(path, values.shape[1])
    if len(names) != values.shape[1]:
        raise ValueError(f'{len(names)} names ({", ".join(names)}) were given for '
                         f'{values.shape[1]} channels of {path}: one a channel is needed')
    if len(set(names)) != len(names):
        raise ValueError(f'channel names {", ".join(names)} are not all different')
    _check(path, values, names)
    if time is None:
        if rate_hz is None:
            raise ValueError('neither rate_hz nor a time column was given; one is needed')
        return Samples(values * scale, float(rate_hz), names, round(start_s * 1e9))
    values, rate_hz, start_ns = _on_grid(path, time, values, rate_hz)
    return Samples(values * scale, rate_hz, names, start_ns)


def _check_columns(path, count):
    """Raise ValueError if a table has more columns than a bag may have topics."""
    if count > LIMITS.table_columns:
        raise ValueError(f'{path} has {count} columns; {LIMITS.table_columns} are read (a row is '
                         'one sampling instant: is it transposed?)')


def _check(path, values, names):
    if len(values) < 2:
        raise ValueError(f'{path} has {len(values)} rows of samples; at least 2 are needed')
    bad = np.argwhere(np.isinf(values))
    if len(bad):
        raise ValueError(f'{path}: sample {bad[0][0]} of {names[bad[0][1]]} is infinite; '
                         'leave the cell empty (or NaN) if it is missing')
    for i, name in enumerate(names):
        if np.isnan(values[:, i]).all():
            raise ValueError(f'{path}: {name} has no sample at all, only NaN; leave it out')


def _csv(path, columns, time_column):
    try:
        with open(path, newline='', encoding='utf-8-sig') as f:
            return _rows(path, csv.reader(f), columns, time_column)
    except (csv.Error, UnicodeDecodeError) as error:
        raise ValueError(f'{path} is not CSV in UTF-8: {error}') from None


def _rows(path, reader, columns, time_column):
    header = [h.strip() for h in next((r for r in reader if r), ())]
    if not header:
        raise ValueError(f'{path} is empty; a line of column names and rows are needed')
    _check_columns(path, len(header))
    if any(_number(h) is not None for h in header):
        raise ValueError(f'{path}: the first line {",".join(header[:4])} holds numbers; a line '
                         'of column names is needed above them')
    if len(set(header)) != len(header):
        raise ValueError(f'{path} has two columns of one name: {", ".join(header)}')
    chosen = list(columns) if columns else [h for h in header if h != time_column]
    for name in chosen + ([time_column] if time_column else []):
        if name not in header:
            raise ValueError(f'{path} has no column {name!r}; it has {", ".join(header)}')
    places = [header.index(name) for name in chosen]
    # Times are kept as words: a float has no room for nanoseconds since 1970.
    cells, times = array('d'), []
    for row in reader:
        if not row:
            continue
        line = reader.line_num
        if len(row) != len(header):
            raise ValueError(f'{path}, line {line}: {len(row)} cells, but the header has '
                             f'{len(header)}; rows must not be ragged')
        for name, place in zip(chosen, places):
            cell = row[place].strip()
            value = float('nan') if not cell else _number(cell)
            if value is None:
                raise ValueError(f'{path}, line {line}, column {name}: {cell!r:.40} is not a '
                                 'number (a missing sample is an empty cell or nan)')
            cells.append(value)
        if time_column:
            times.append(row[header.index(time_column)])
    table = np.frombuffer(cells).reshape(-1, len(places)) if cells else np.empty((0, len(places)))
    return chosen, table, _nanoseconds(path, time_column, times) if time_column else None


def _number(word):
    try:
        return float(word)
    except ValueError:
        return None


def _nanoseconds(path, name, times):
    if name.endswith('_ns'):
        try:
            found = np.array([int(t) for t in times], np.int64)
        except (ValueError, OverflowError):
            raise ValueError(f'{path}: {name} must hold whole numbers of nanoseconds') from None
        return _in_range(path, name, found)
    seconds = np.array(times, dtype=float) if not isinstance(times, list) else \
        np.array([_number(t) if t.strip() else np.nan for t in times], dtype=float)
    if not np.isfinite(seconds).all():
        raise ValueError(f'{path}: {name} has a time that is missing or not a number; '
                         'every row needs one')
    if np.abs(seconds).max(initial=0.0) > 9e9:
        raise ValueError(f'{path}: {name} holds {np.abs(seconds).max():g}, which is no time in '
                         'seconds since 1970; name a column of nanoseconds so that it ends in _ns')
    return _in_range(path, name, np.rint(seconds * 1e9).astype(np.int64))


def _in_range(path, name, times):
    """Return times [ns] that a message can hold; ValueError for those beyond."""
    if len(times) and not (0 <= times.min() and times.max() < 2 ** 31 * 10 ** 9):
        raise ValueError(f'{path}: {name} goes from {times.min()} to {times.max()} ns; ROS knows '
                         'times from 1970 to 2038')
    return times


def _variables(path, columns, variable, time_column, transpose):
    try:
        held = arrays_of(path)
    except ValueError as error:
        raise ValueError(f'{path} {error}') from None
    arrays = {k: v for k, v in held.items() if isinstance(v, np.ndarray) and v.size > 1
              and v.dtype.kind in 'fiub' and v.ndim <= 2}
    listing = ', '.join(f'{k} {v.shape}' for k, v in arrays.items()) or 'none'

    def pick(name):
        if name not in arrays:
            raise ValueError(f'{path} has no array of real numbers {name!r}; it has {listing}')
        return arrays[name]

    time = None
    if time_column:
        time = _nanoseconds(path, time_column, pick(time_column).ravel())
    if variable is None and columns:
        picked = [pick(c) for c in columns]
        if any(max(p.shape) != p.size for p in picked) or len({p.size for p in picked}) > 1:
            raise ValueError(f'{path}: {", ".join(columns)} must be one-dimensional and of one '
                             f'length; it has {listing}')
        return list(columns), np.column_stack([p.ravel().astype(float) for p in picked]), time
    if variable is None:
        others = [k for k in arrays if k != time_column]
        if len(others) != 1:
            raise ValueError(f'{path} has {len(others)} arrays ({listing}); '
                             'name one by variable, or several by columns')
        variable = others[0]
    values = pick(variable).astype(float)
    if values.ndim == 1 or 1 in values.shape:
        values = values.reshape(-1, 1)
    elif transpose:
        values = values.T
    elif values.shape[0] < values.shape[1]:
        raise ValueError(f'{path}: {variable} has shape {values.shape}, more columns than rows: '
                         'it looks transposed; one row a sampling instant is needed (transpose '
                         'turns it)')
    names = list(columns) if columns else (
        [variable] if values.shape[1] == 1 else
        [f'{variable}_{i}' for i in range(values.shape[1])])
    return names, values, time


def _on_grid(path, time, values, rate_hz):
    """Return the values on the even grid of their times, its rate [Hz] and its start [ns]."""
    if len(time) != len(values):
        raise ValueError(f'{path}: {len(time)} times for {len(values)} rows of samples')
    steps = np.diff(time)
    if (steps <= 0).any():
        raise ValueError(f'{path}: the time of row {int((steps <= 0).argmax()) + 1} does not '
                         'rise; sort the rows and leave out doubles')
    period = 1e9 / rate_hz if rate_hz else float(np.median(steps))
    since = (time - time[0]).astype(float)
    if since[-1] / period > max(LIMITS.gap_numbers, LIMITS.sparse * len(time)) / values.shape[1]:
        raise ValueError(f'{path}: {len(time)} rows would be spread over {since[-1] / period:.3g} '
                         f'of {1e9 / period:.6g} Hz; cut the file where the times jump, or give '
                         'rate_hz')
    if not rate_hz:
        # the slope over counted periods: a median of rounded steps would drift
        counts = np.rint(since / period)
        period = float(since @ counts / (counts @ counts))
    ticks = np.rint(since / period).astype(np.int64)
    off = np.abs(since / period - ticks)
    if off.max() > _OFF_GRID or (np.diff(ticks) < 1).any():
        row = int(off.argmax())
        raise ValueError(f'{path}: row {row} is {100 * off[row]:.0f} % of a period off the even '
                         f'grid of {1e9 / period:.6g} Hz; resample the data to an even rate, '
                         'or give its rate_hz')
    grid = np.full((ticks[-1] + 1, values.shape[1]), np.nan)
    grid[ticks] = values
    return grid, 1e9 / period, int(time[0])
