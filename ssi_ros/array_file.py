"""
The arrays of an NPZ or MAT file, checked before memory is taken for them.

A MAT file is read in a process of its own: the reader of scipy is compiled code, and a crafted
file can crash it.
"""
import os
from pathlib import Path
import resource
import signal
import subprocess
import sys
import tempfile
import tokenize
import zipfile
import zlib

import numpy as np

from ssi_ros.limits import LIMITS

NUMBERS, TEXTS = 'fiub', 'Uc'       # kinds of NumPy's types
_SECONDS = 60            # that reading a MAT file may take
_ROOM = 2 << 30          # bytes that its process may take
_READ = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def arrays_of(path, texts=False):
    """
    Return the arrays of numbers of a .npz or .mat file by name.

    Parameters
    ----------
    path : Path
        The file.
    texts : bool
        Return arrays of texts and of complex numbers as well, which models hold: a cell array or
        a char matrix of MATLAB becomes texts, a field of a struct `struct.field`.

    Raises
    ------
    ValueError
        If the file is neither, is damaged, or holds more than a file of its size may; the
        sentence goes on behind the name of the file.

    """
    kinds = NUMBERS + TEXTS if texts else NUMBERS
    if path.suffix.lower() == '.npz':
        return _npz(path, kinds)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / 'arrays.npz'
        root = str(Path(__file__).resolve().parents[1])
        try:
            done = subprocess.run(
                [sys.executable, '-m', 'ssi_ros.array_file', str(path.resolve()), str(out)],
                cwd=folder, capture_output=True, text=True, timeout=_SECONDS,
                env={**os.environ, 'OPENBLAS_NUM_THREADS': '1', 'PYTHONPATH': os.pathsep.join(
                    [root, os.environ.get('PYTHONPATH', '')])})
        except subprocess.TimeoutExpired:
            raise ValueError(f'cannot be read as .mat in {_SECONDS} s') from None
        if done.returncode < 0:
            raise ValueError('cannot be read as .mat: it crashes the reader of scipy '
                             f'({signal.Signals(-done.returncode).name})')
        if done.returncode:
            words = (done.stderr.strip().splitlines() or ['no reason given'])[-1][:200]
            raise ValueError(f'cannot be read as .mat: {words}')
        found = _npz(out, kinds)
        return found if texts else {k: v for k, v in found.items() if '.' not in k}


def _npz(path, kinds):
    found, total = {}, 0
    try:
        with zipfile.ZipFile(path) as file:
            for member in file.infolist():
                if not member.filename.endswith('.npy'):
                    continue
                total += member.file_size
                if total > LIMITS.total_bytes(path.stat().st_size):
                    raise ValueError(f'its arrays have {total} bytes or more; a file of its size '
                                     f'may hold {LIMITS.total_bytes(path.stat().st_size)}')
                name = member.filename.removesuffix('.npy')
                with file.open(member) as data:
                    values = _npy(data, member.file_size, kinds)
                if values is not None:
                    found[name] = values
                elif kinds != NUMBERS:
                    raise ValueError(f'{name} holds neither numbers nor texts')
    except (ValueError, TypeError, OSError, EOFError, zipfile.BadZipFile, zlib.error, KeyError,
            NotImplementedError, RuntimeError, SyntaxError, MemoryError,
            tokenize.TokenError) as error:
        words = ' '.join(str(error).split())[:200] or type(error).__name__
        raise ValueError(f'cannot be read as .npz: {words}') from None
    return found


def _npy(data, size, kinds):
    """Return one array, once its header agrees with its size; None if it is of another kind."""
    version = np.lib.format.read_magic(data)
    if version not in _READ:
        return None
    shape, turned, dtype = _READ[version](data)
    if dtype.kind not in kinds:
        return None
    count = 1
    for n in shape:
        count *= n
    if count < 0 or count * dtype.itemsize != size - data.tell():
        raise ValueError(f'an array claims the shape {shape} of {dtype}, and has '
                         f'{size - data.tell()} bytes')
    if not count * dtype.itemsize:
        return np.zeros(shape, dtype)
    values = np.frombuffer(data.read(), dtype=dtype)
    return values.reshape(shape, order='F' if turned else 'C')


def _convert(path, out):
    """Write the arrays of a MAT file to an NPZ file; this is what the process does."""
    from scipy.io import loadmat, matlab      # here, for it takes a while and CSV needs none

    resource.setrlimit(resource.RLIMIT_AS, (_ROOM, _ROOM))
    try:
        held = loadmat(path)
    except NotImplementedError:
        raise ValueError("it is a MAT file of version 7.3 (HDF5); save it with '-v7'") from None
    except (ValueError, TypeError, OSError, EOFError, MemoryError, OverflowError, zlib.error,
            KeyError, IndexError, matlab.MatReadError) as error:
        raise ValueError(' '.join(str(error).split()) or type(error).__name__) from None
    found = {}
    for name, value in held.items():
        if name.startswith('__') or not isinstance(value, np.ndarray):
            continue
        parts = {f'{name}.{field}': value[field].ravel()[0] for field in value.dtype.names} if (
            value.dtype.names and value.size) else {name: value}
        found |= {n: plain for n, v in parts.items() if (plain := _plain(v)) is not None}
    np.savez(out, **found)


def _plain(value):
    """Return a variable of MATLAB as numbers or texts, None if it is neither."""
    value = np.asarray(value)
    if value.dtype.kind in NUMBERS + TEXTS:
        return value
    if value.dtype.kind != 'O':
        return None
    words = []
    for item in value.ravel():          # a cell array
        while isinstance(item, np.ndarray) and item.size == 1:
            item = item.ravel()[0]
        if not isinstance(item, str):
            return None
        words.append(item)
    return np.array(words, dtype=str)


if __name__ == '__main__':
    try:
        _convert(*sys.argv[1:])
    except ValueError as why:
        raise SystemExit(f'{why}') from None
