"""The files of a bag, and its metadata.yaml: validated once, or left out with a warning."""
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
import re
import stat

from ssi_ros.plain_yaml import load_plain, read_plain

from .layout import ROOT


@dataclass(frozen=True)
class Metadata:
    """
    What metadata.yaml says beyond the files.

    Attributes
    ----------
    files : tuple of Path
        In order.
    qos, hashes : dict
        Topic -> tuple of profiles; topic -> RIHS01 hash.
    custom_data : dict
        Words to words.
    warnings : tuple of str
        Why it, or a part of it, was not believed.

    """

    files: tuple
    qos: dict = field(default_factory=dict)
    hashes: dict = field(default_factory=dict)
    custom_data: dict = field(default_factory=dict)
    warnings: tuple = ()


def regular(path):
    """
    Return a path that is a file with contents of its own.

    Raises
    ------
    ValueError
        If it is a pipe, a device or a socket, which may never end.

    """
    if not stat.S_ISREG(path.stat().st_mode):
        raise ValueError(f'{path} is not a regular file but a pipe, a device or a folder; give '
                         'the folder of a bag, or its .mcap')
    return path


def loose_files(folder):
    """Return the .mcap (or else .db3) files of a folder, NAME_2 before NAME_10."""
    def number(path):
        return [(not w.isdecimal(), int(w) if w.isdecimal() else 0, w)
                for w in re.split(r'(\d{1,18})', path.name)]
    for suffix in ('*.mcap', '*.db3'):
        files = sorted((p for p in folder.glob(suffix) if not p.is_dir()), key=number)
        if files:
            return files
    return []


def read_metadata(path):
    """
    Return the files of a bag in order, and what its metadata.yaml says of them.

    Parameters
    ----------
    path : Path
        Folder of the bag, or one file.

    Raises
    ------
    ValueError
        If there is no bag, a file is missing, outside of the folder or not a regular one.

    """
    if not path.exists():
        raise ValueError(f'{path} does not exist; give the folder of a bag, or its .mcap')
    if not path.is_dir():
        return Metadata((regular(path),))
    metadata, said = path / 'metadata.yaml', None
    warnings = ()
    if metadata.exists():
        try:
            said = _validated(metadata)
        except (ValueError, OSError) as error:
            warnings = (f'{error}; the files of the folder are read without it',)
    if said is not None:
        return _complete(path, said)
    files = loose_files(path)
    if not files:
        raise ValueError(f'{path} is not a bag: it has no metadata.yaml that can be read, and no '
                         '.mcap or .db3')
    return Metadata(tuple(map(regular, files)), warnings=warnings)


def _validated(path):
    """Return what is below the root of a metadata.yaml; ValueError where a type is wrong."""
    plain = read_plain(path)
    information = plain.get(ROOT) if isinstance(plain, dict) else None
    if not isinstance(information, dict):
        raise ValueError(f'{path} is not that of a rosbag2 bag: it has no {ROOT}')
    for key, kind, words in (('relative_file_paths', list, 'a list of file names'),
                             ('topics_with_message_count', list, 'a list of topics'),
                             ('custom_data', dict, 'a mapping of words to words'),
                             ('compression_mode', str, 'a word')):
        value = information.get(key)
        if value is not None and not isinstance(value, kind):
            raise ValueError(f'{path}: {key} is {value!r:.60}; it must be {words}')
    names = information.get('relative_file_paths')
    if not names or not all(isinstance(n, str) and n and '\0' not in n for n in names):
        raise ValueError(f'{path}: relative_file_paths names no files')
    if len(names) != len(set(names)):
        raise ValueError(f'{path}: relative_file_paths names a file twice')
    return information


def _complete(path, said):
    files = []
    for name in said['relative_file_paths']:
        parts = PurePosixPath(name).parts
        if name.startswith('/') or '..' in parts:
            raise ValueError(f'{path / "metadata.yaml"} names {name!r:.100}, which is outside of '
                             'the folder of the bag, and is not read; correct relative_file_paths')
        files.append(path / name)
    missing = [f.name for f in files if not f.exists()]
    if missing:
        raise ValueError(f'{path} lacks the file {", ".join(missing[:10])} '
                         'that its metadata.yaml names; restore it, or run ssi_ros recover '
                         f'{path} for the rest')
    mode = (said.get('compression_mode') or 'none').lower()
    if mode in ('file', 'message'):
        raise ValueError(f'{path} was compressed by rosbag2 {mode} by {mode}; convert it to '
                         'plain MCAP first (ros2 bag convert)')
    qos, hashes, warnings = _topics(path, said.get('topics_with_message_count') or ())
    custom = said.get('custom_data') or {}
    if mixed := custom.get('mixed_publishers'):
        warnings += (f'several publishers sent at once on {mixed!s:.200}: their messages are '
                     'mixed, and nothing that is made of them can be trusted',)
    return Metadata(tuple(map(regular, files)), qos, hashes,
                    {str(k): str(v) for k, v in custom.items()}, tuple(warnings))


def _topics(path, entries):
    qos, hashes, wrong = {}, {}, 0
    for entry in entries:
        topic = entry.get('topic_metadata') if isinstance(entry, dict) else None
        if not isinstance(topic, dict) or not isinstance(topic.get('name'), str):
            wrong += 1
            continue
        qos[topic['name']] = profiles_in(topic.get('offered_qos_profiles'))
        digest = topic.get('type_description_hash')
        hashes[topic['name']] = digest if isinstance(digest, str) else ''
    warnings = [f'{path / "metadata.yaml"}: {wrong} topic(s) have no name'] if wrong else []
    return qos, hashes, warnings


def profiles_in(given):
    """Return the profiles that a list, or the YAML of one, holds; what is none is left out."""
    if isinstance(given, str):
        try:
            given = load_plain(given, 'a quality of service')
        except ValueError:
            return ()
    if not isinstance(given, list):
        return ()
    return tuple(p for p in given if isinstance(p, dict) and all(
        isinstance(k, str) and _plain_value(v) for k, v in p.items()))


def _plain_value(value):
    """Return whether a value can be one of a profile: a word, a number, or a span of time."""
    if isinstance(value, dict):
        return all(isinstance(k, str) and isinstance(v, int) for k, v in value.items())
    return isinstance(value, (str, int))


def kept_custom_data(text):
    """Return the custom data of the `serialized_metadata` of a file, None if there is none."""
    try:
        plain = load_plain(text, 'the metadata record')
    except ValueError:
        return None
    information = plain.get(ROOT, plain) if isinstance(plain, dict) else None
    custom = information.get('custom_data') if isinstance(information, dict) else None
    return {str(k): str(v) for k, v in custom.items()} if isinstance(custom, dict) else None


def path_of(path):
    """Return a Path of what was given; ValueError for text that no file name can hold."""
    if '\0' in str(path):
        raise ValueError('a file name holds a NUL character')
    return Path(path)
