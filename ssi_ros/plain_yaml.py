"""YAML of others: bounded in size, depth and aliases before a value is made of it."""
from pathlib import Path
import stat

from ssi_ros.limits import LIMITS
import yaml

_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)      # libyaml where it is there: 10 times


def load_plain(text, what='the YAML'):
    """
    Return the plain data of a YAML text.

    Parameters
    ----------
    text : str
        The text.
    what : str
        What it is, for the sentence.

    Raises
    ------
    ValueError
        If it is not YAML, or larger, deeper or, with its aliases written out, longer than
        allowed.

    """
    if len(text) > LIMITS.yaml_bytes:
        raise ValueError(f'{what} has {len(text)} characters; {LIMITS.yaml_bytes} are read')
    try:
        _check(yaml.parse(text, Loader=_LOADER), what)
        return yaml.load(text, Loader=_LOADER)
    except (yaml.YAMLError, RecursionError) as error:
        words = ' '.join(str(error).split())[:200]
        raise ValueError(f'{what} is not YAML: {words}') from None
    except (ValueError, OverflowError, TypeError) as error:        # dates, numbers, keys
        raise ValueError(f'{what} is not plain YAML: {error}') from None


def read_plain(path):
    """
    Return the plain data of a YAML file; see `load_plain`.

    Raises
    ------
    ValueError
        As `load_plain`, or if it is no regular file or no text in UTF-8.
    OSError
        If the file cannot be read.

    """
    path = Path(path)
    kept = path.stat()
    if not stat.S_ISREG(kept.st_mode):
        raise ValueError(f'{path} is not a file; give a YAML file')
    if kept.st_size > LIMITS.yaml_bytes:
        raise ValueError(f'{path} has {kept.st_size} bytes; {LIMITS.yaml_bytes} are read')
    try:
        text = path.read_text(encoding='utf-8')
    except UnicodeDecodeError:
        raise ValueError(f'{path} is not YAML: it is not text in UTF-8') from None
    return load_plain(text, str(path))


def _check(events, what):
    """Raise ValueError if the nodes are too deep, or too many once aliases are written out."""
    anchors, open_nodes, total = {}, [], 0
    for event in events:
        if isinstance(event, yaml.AliasEvent):
            if event.anchor in (anchor for anchor, _ in open_nodes):
                raise ValueError(f'{what} has an alias of what it is in')
            total += anchors.get(event.anchor, 1)
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_nodes.pop()
            anchors[anchor] = total - before + 1
        elif isinstance(event, yaml.NodeEvent):
            total += 1
            if isinstance(event, yaml.CollectionStartEvent):
                open_nodes.append((event.anchor, total))
            else:
                anchors[event.anchor] = 1
        if len(open_nodes) > LIMITS.yaml_depth:
            raise ValueError(f'{what} is nested deeper than {LIMITS.yaml_depth} levels')
        if total > LIMITS.yaml_nodes:
            raise ValueError(f'{what} holds more than {LIMITS.yaml_nodes} values')
