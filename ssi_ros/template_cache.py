"""
Templates on disk: they depend on the model alone, so the next process need not make them again.

The key is made of the numbers of the model and of the source of everything that templates are made
by, so that a changed effect never meets an old file. The folder is `$XDG_CACHE_HOME/ssi_ros`, or
`~/.cache/ssi_ros`; deleting it costs some seconds, no more.
"""
from dataclasses import replace
from functools import lru_cache
import hashlib
import inspect
import json
import os
from pathlib import Path
import zipfile

import numpy as np

import ssi_ros
from ssi_ros.effects import effect_class
from ssi_ros.gap.inference.score_test import make_templates, Templates
from ssi_ros.gap.inference.unmodelled.templates import (
    ChangeTemplates, make_change_templates, UnmodelledChange)
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.nominal.starting_points import starting_points
from ssi_ros.gap.spectra.segmentation import frame_at
from ssi_ros.updating.merged_bins import WhiteChanges
from ssi_ros.whole_file import write_arrays

KEPT = 4                # sets of templates that stay, on disk and in memory; some 10 MB each
LAYERS = ('model', 'effects', 'gap', 'updating')
# none, or half a file of a crash: templates are made anew
UNREADABLE = OSError, ValueError, KeyError, IndexError, EOFError, TypeError, zipfile.BadZipFile
_IN_MEMORY = {}


def folder():
    """Return where templates are kept."""
    base = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    return Path(base) / 'ssi_ros'


def effect_templates(simulator, settings, names, progress):
    """
    Return the templates of effects, by name, around a model, kept in memory and on disk.

    `progress` is called with the share done. Those of a record with long gaps are kept in memory.
    """
    frame, present, errors = simulator.frame, simulator.present, simulator.spacecraft.calibration
    if simulator.recorded or simulator.compensation and any(errors.values):
        # of one record alone
        effects = starting_points([effect_class(n) for n in names], simulator.moved)
        return make_templates(simulator, effects, progress)
    spacecraft = _bare(simulator.spacecraft)
    cut = (_rows(simulator), frame.rows, settings.low_hz, settings.high_share,
           simulator.compensation is not None)
    key = (spacecraft, *cut, frame.begins, present, names)
    whole = frame.begins[-1] == (frame.segments - 1) * frame.rows
    if key not in _IN_MEMORY:
        effects = starting_points([effect_class(n) for n in names], spacecraft)
        name = templates_key(spacecraft, *cut, present, names=names)
        found = load_templates(name, effects) if whole else None
        if found is None:
            found = make_templates(_alone(simulator, settings), effects, progress)
            if whole:
                save_templates(name, found, effects)
        while len(_IN_MEMORY) >= KEPT:
            del _IN_MEMORY[next(iter(_IN_MEMORY))]
        _IN_MEMORY[key] = found
    return _IN_MEMORY[key].late(simulator.late, frame)


def unmodelled_templates(simulator, settings):
    """Return the templates of changes that no effect of the library makes; as above."""
    frame = simulator.frame
    if simulator.recorded:
        return make_change_templates(simulator)
    found = _unmodelled(_bare(simulator.spacecraft), _rows(simulator), frame.rows, frame.segments,
                        settings, simulator.present)
    return ChangeTemplates(*(t.late(simulator.late, frame) for t in (
        found.constant, found.drifting)))


@lru_cache(maxsize=KEPT)
def _unmodelled(spacecraft, rows, width, segments, settings, present):
    # means over the record: where the segments are does not count
    name = 'changes-' + templates_key(
        spacecraft, rows, width, segments, settings.low_hz, settings.high_share, present)
    found = load_changes(name)
    if found is None:
        frame = frame_at(spacecraft.rate_hz, width, tuple(range(0, segments * width, width)),
                         settings)
        found = make_change_templates(Simulator(
            spacecraft, frame, rows / spacecraft.rate_hz, present))
        save_changes(name, found)
    return found


def _rows(simulator):
    return round(simulator.duration_s * simulator.spacecraft.rate_hz)


def _bare(spacecraft):
    return replace(spacecraft, calibration=spacecraft.calibration.bare)


def _alone(simulator, settings):
    """Return a model side without what is of one record: lost rows, instants, motion, forces."""
    frame, craft = simulator.frame, simulator.spacecraft
    return simulator.but(frame=frame_at(frame.rate_hz, frame.rows, frame.begins, settings),
                         jitter_noise=None, late=(), spacecraft=craft.at_errors(
                             craft.calibration.bare.values))


def templates_key(*numbers, names=()):
    """Return the name of a file for numbers (anything with a full repr) and effects."""
    digest = hashlib.sha256(repr(numbers).encode())
    package = Path(ssi_ros.__file__).parent
    for layer in LAYERS:
        for path in sorted((package / layer).rglob('*.py')):
            digest.update(path.read_bytes())
    for name in names:
        # an effect of somebody else has its source elsewhere; to find that takes a while
        kind = effect_class(name)
        own = kind.__module__.startswith('ssi_ros.')
        digest.update((name if own else inspect.getsource(kind)).encode())
    return f'templates-{digest.hexdigest()[:32]}.npz'


def load_templates(key, effects):
    """Return the templates of a key, or None; `effects` in the order they were made in."""
    try:
        with np.load(folder() / key) as file:
            kept = [effects[i] for i in file['kept']]
            modulation = {int(k[1:]): file[k] for k in file.files if k[1:].isdigit()}
            return Templates(
                tuple(kept), WhiteChanges.read(file), modulation, float(file['level']),
                file['shifts'] if 'shifts' in file.files else None)
    except UNREADABLE:
        return None


def save_templates(key, templates, effects):
    """Write templates whole or not at all; a folder that cannot be written is left alone."""
    _save(key, **templates.white.arrays(), level=templates.level,
          kept=[effects.index(e) for e in templates.effects],
          **{f'm{i}': m for i, m in templates.modulation.items()},
          **({} if templates.shifts is None else {'shifts': templates.shifts}))


def load_changes(key):
    """Return the ChangeTemplates of a key, or None."""
    try:
        with np.load(folder() / key) as file:
            words = json.loads(str(file['effects']))
            return ChangeTemplates(*(Templates(
                tuple(UnmodelledChange(**{**w, 'damped': w['damped'] and tuple(w['damped'])})
                      for w in words[i]), WhiteChanges.read(file, i), {}, float(file[f'level{i}']))
                for i in range(2)))
    except UNREADABLE:
        return None


def save_changes(key, found):
    """Write ChangeTemplates as `save_templates` does."""
    both = found.constant, found.drifting
    _save(key, effects=json.dumps([[vars(e) for e in t.effects] for t in both]),
          **found.constant.white.arrays(0), **found.drifting.white.arrays(1),
          **{f'level{i}': t.level for i, t in enumerate(both)})


def _save(key, **arrays):
    try:
        folder().mkdir(parents=True, exist_ok=True)
        write_arrays(folder() / key, **arrays)
        kind = key.partition('-')[0]
        files = sorted(folder().glob(f'{kind}-*.npz'), key=lambda p: p.stat().st_mtime)
        for path in files[:-KEPT]:
            path.unlink(missing_ok=True)
    except OSError:
        return
