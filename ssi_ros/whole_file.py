"""Files that are there whole or not at all: written beside their name, then moved onto it."""
from contextlib import contextmanager
import os
from pathlib import Path
import zipfile


@contextmanager
def whole_path(path):
    """
    Yield a path in the same folder to write to; it takes the name when the block ends well.

    After an error nothing new stands under the name, and what stood there is kept. A name that is
    no regular file, such as /dev/stdout, is written to itself.

    Raises
    ------
    OSError
        Of the writing, with the name of the file, which an error of a full disk does not have.

    """
    final = Path(os.path.realpath(path))
    if final.exists() and not final.is_file():
        draft = final
    else:
        draft = final.with_name(f'.{os.getpid()}.part.{final.name}')
    try:
        yield draft
        if draft != final:
            if final.exists():
                os.chmod(draft, final.stat().st_mode & 0o7777)
            os.replace(draft, final)
    except OSError as error:
        raise type(error)(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        if draft != final:
            draft.unlink(missing_ok=True)


@contextmanager
def whole_file(path, mode='w', **options):
    """Yield an open file for `whole_path`; `mode` and `options` are those of `open`."""
    with whole_path(path) as draft, open(draft, mode, **options) as file:
        yield file


def write_arrays(path, /, *, compressed=False, **arrays):
    """
    Write arrays by name, as numpy.savez does.

    Where a disk is full NumPy before 2 leaves the archive open, which then prints a trace.
    """
    import numpy as np                # here, for a verb's --help comes by this file
    how = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    with whole_path(path) as draft, zipfile.ZipFile(draft, 'w', how) as archive:
        for name, array in arrays.items():
            with archive.open(f'{name}.npy', 'w', force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)


def write_whole(path, text):
    """Write a text, in UTF-8."""
    with whole_file(path, encoding='utf-8') as file:
        file.write(text)
