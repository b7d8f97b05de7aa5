"""
Templates on disk: they depend on the model alone, so the next process need not make them again.

The key is made of the numbers of the model and of the source of everything that templates are made
by, so that a changed effect never meets an old file. The folder is `$XDG_CACHE_HOME/ssi_ros`, or
`~/.cache/ssi_ros`; deleting it costs some seconds, no more.
"""
import hashlib
import inspect
import os
from pathlib import Path
import tempfile
import zipfile

import numpy as np

import ssi_ros
from ssi_ros.effects import effect_class
from ssi_ros.gap.scores import Templates

KEPT = 4                # files that stay; each has some 120 MB
LAYERS = ('model', 'effects', 'gap')


def folder():
    """Return where templates are kept."""
    base = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    return Path(base) / 'ssi_ros'


def templates_key(*numbers, names=()):
    """Return the name of a file for numbers (anything with a full repr) and effects."""
    digest = hashlib.sha256(repr(numbers).encode())
    package = Path(ssi_ros.__file__).parent
    for layer in LAYERS:
        for path in sorted((package / layer).glob('*.py')):
            digest.update(path.read_bytes())
    for name in names:
        # an effect of somebody else has its source elsewhere
        digest.update(inspect.getsource(effect_class(name)).encode())
    return f'templates-{digest.hexdigest()[:32]}.npz'


def load_templates(key, effects):
    """
    Return the templates of a key, or None.

    Parameters
    ----------
    key : str
        Of `templates_key`.
    effects : sequence of Effect
        Starting points in the order in which they were made.

    """
    try:
        with np.load(folder() / key) as file:
            kept = [effects[i] for i in file['kept']]
            swings = {int(k[5:]): file[k] for k in file.files if k.startswith('swing')}
            return Templates(tuple(kept), file['changes'], swings, float(file['level']))
    except (OSError, ValueError, KeyError, IndexError, EOFError, zipfile.BadZipFile):
        return None                     # none, or half a file of a crash: make them anew


def save_templates(key, templates, effects):
    """Write templates whole or not at all; a folder that cannot be written is left alone."""
    try:
        folder().mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=folder(), suffix='.part')
        with os.fdopen(handle, 'wb') as file:
            np.savez(file, changes=templates.changes, level=templates.level,
                     kept=[effects.index(e) for e in templates.effects],
                     **{f'swing{i}': s for i, s in templates.swings.items()})
        os.replace(name, folder() / key)
        files = sorted(folder().glob('templates-*.npz'), key=lambda p: p.stat().st_mtime)
        for path in files[:-KEPT]:
            path.unlink(missing_ok=True)
    except OSError:
        return
