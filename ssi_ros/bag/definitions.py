"""Definition text and type hash of the message types that are installed on this machine."""
from functools import lru_cache
import json
import os
from pathlib import Path
import sys

from .schema import members_of, short_name, SIZES, STRINGS


def definition_of(type_name):
    """
    Return the definition of an installed message type in the ros2msg form.

    Parameters
    ----------
    type_name : str
        `pkg/msg/Type`.

    Returns
    -------
    str
        The text of its .msg file, then that of each dependency once, behind a line of 80 `=`
        and `MSG: pkg/Type`, in the order of rosbag2 (depth first, names sorted).

    Raises
    ------
    ValueError
        If the type is not installed.

    """
    return _definition(short_name(type_name), prefixes())


def type_hash_of(type_name):
    """
    Return the RIHS01 hash of an installed message type, as rosidl wrote it beside the type.

    Raises
    ------
    ValueError
        If the type, or its hash (before ROS 2 Iron), is not installed.

    """
    return _type_hash(short_name(type_name), prefixes())


def prefixes():
    """Return the folders under which ROS installs packages: AMENT_PREFIX_PATH, this Python."""
    given = [p for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
             if os.path.isabs(p)]
    return (*given, sys.prefix)


def _file(short, prefixes, suffix):
    package, name = short.split('/')
    for prefix in prefixes:
        path = Path(prefix) / 'share' / package / 'msg' / (name + suffix)
        if path.is_file():
            return path
    raise ValueError(f'{package}/msg/{name} is not installed: no share/{package}/msg/{name}'
                     f'{suffix} under {", ".join(prefixes)}; install ros-jazzy-'
                     f'{package.replace("_", "-")}, or source the workspace that has it')


@lru_cache(maxsize=None)
def _definition(short, prefixes):
    seen = {short}

    def full(name):
        text = _file(name, prefixes, '.msg').read_text()
        needed = {m.base for m in members_of(text, name.split('/')[0])}
        for base in sorted(needed - STRINGS - set(SIZES)):
            if base not in seen:
                seen.add(base)
                text += f'\n{"=" * 80}\nMSG: {base}\n{full(base)}'
        return text

    return full(short)


@lru_cache(maxsize=None)
def _type_hash(short, prefixes):
    path = _file(short, prefixes, '.json')
    long = short.replace('/', '/msg/')
    for entry in json.loads(path.read_text()).get('type_hashes', ()):
        if entry['type_name'] == long:
            return entry['hash_string']
    raise ValueError(f'{path} holds no hash of {long}; reinstall the package of the type')
