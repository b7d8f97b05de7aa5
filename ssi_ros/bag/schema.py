"""The members of a message type, parsed from its definition text in the ros2msg form."""
from dataclasses import dataclass
import re

from ssi_ros.limits import LIMITS


# Bytes of each primitive in CDR; each is aligned to its own size.
SIZES = {'bool': 1, 'byte': 1, 'char': 1, 'int8': 1, 'uint8': 1, 'int16': 2, 'uint16': 2,
         'int32': 4, 'uint32': 4, 'int64': 8, 'uint64': 8, 'float32': 4, 'float64': 8}
STRINGS = {'string', 'wstring'}
TIME, HEADER = 'builtin_interfaces/Time', 'std_msgs/Header'

_SEPARATOR = re.compile(r'^={80}\n+MSG: *(\S+)[^\n]*\n?', re.MULTILINE)
_MEMBER = re.compile(r'^(?P<base>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[(?P<count><?=?\d*)\])?\s+'
                     r'(?P<name>[A-Za-z]\w*)(?P<rest>\s*=.*|\s+.*)?$')


_MOST_ELEMENTS = 2 ** 31 - 1           # of an array, as rosidl bounds them


@dataclass(frozen=True)
class Member:
    """
    One member of a message.

    Attributes
    ----------
    name : str
        Name in the message.
    base : str
        A primitive, 'string', 'wstring' or the short name `pkg/Type` of a message.
    count : int or None
        1 for a plain member, the length of an array, None for a sequence.
    plain : bool
        False for an array or a sequence, whose elements need an index.

    """

    name: str
    base: str
    count: int
    plain: bool


def short_name(type_name):
    """
    Return `pkg/Type` for `pkg/msg/Type` or `pkg/Type`.

    Raises
    ------
    ValueError
        If the name is neither.

    """
    parts = str(type_name).split('/')
    if len(parts) == 3 and parts[1] == 'msg':
        del parts[1]
    if len(parts) != 2 or not all(re.fullmatch(r'[A-Za-z]\w*', p) for p in parts):
        raise ValueError(f'{type_name!r} is not a message type; '
                         'write it as package/msg/Type, such as geometry_msgs/msg/AccelStamped')
    return '/'.join(parts)


def members_of(text, package):
    """
    Return the members that the text of one .msg file declares, constants left out.

    Raises
    ------
    ValueError
        For a line that is not a member, a constant or a comment.

    """
    members = []
    for line in text.splitlines():
        line = line.split('#', 1)[0].strip()
        if not line:
            continue
        match = _MEMBER.match(line)
        if match is None:
            raise ValueError(f'the definition of a type in {package} has a line that is not '
                             f'ros2msg: {line!r}')
        if (match['rest'] or '').lstrip().startswith('='):
            continue                                                 # a constant
        base, count = match['base'], match['count']
        if base not in SIZES and base not in STRINGS:
            if '/' not in base:
                base = HEADER if base == 'Header' else f'{package}/{base}'
            base = short_name(base)
        fixed = count is not None and count.isdigit()
        if fixed and not 1 <= int(count[:12]) <= _MOST_ELEMENTS:
            raise ValueError(f'{package}: {match["name"]} has {count[:20]} elements; 1 to '
                             f'{_MOST_ELEMENTS} are possible')
        members.append(Member(match['name'], base, plain=count is None,
                              count=1 if count is None else int(count) if fixed else None))
    # A structure needs at least one member: rosidl gives an empty message one octet.
    return tuple(members) or (Member('structure_needs_at_least_one_member', 'uint8', 1, True),)


def parse(type_name, text):
    """
    Return the members of a type and of all types it needs.

    Parameters
    ----------
    type_name : str
        `pkg/msg/Type`.
    text : str
        Definition of the type, then each dependency behind a line of 80 `=` and `MSG: pkg/Type`.

    Returns
    -------
    dict
        Short name `pkg/Type` -> tuple of Member.

    Raises
    ------
    ValueError
        If the text does not parse, or a type it names is not in it.

    """
    root = short_name(type_name)
    if len(text) > LIMITS.schema_bytes:
        raise ValueError(f'the definition of {type_name} has {len(text)} characters; '
                         f'{LIMITS.schema_bytes} are read')
    first, *rest = _SEPARATOR.split(text.replace('\r\n', '\n') + '\n')
    if first.startswith('=' * 80) or re.search(r'^\s*(module|struct)\s', first, re.MULTILINE):
        raise ValueError(f'the definition of {type_name} is not in the ros2msg form (IDL is '
                         'not supported); record it on a machine that has its .msg file')
    if len(rest) // 2 >= LIMITS.schema_types:
        raise ValueError(f'the definition of {type_name} holds {len(rest) // 2 + 1} types; '
                         f'{LIMITS.schema_types} are read')
    types = {root: members_of(first, root.split('/')[0])}
    for name, body in zip(rest[::2], rest[1::2]):
        name = short_name(name)
        types[name] = members_of(body, name.split('/')[0])
    for name, members in types.items():
        for m in members:
            if m.base not in SIZES and m.base not in STRINGS and m.base not in types:
                raise ValueError(f'{name}.{m.name} is a {m.base}, which the definition of '
                                 f'{type_name} does not hold')
    _check_depth(types, root, type_name)
    return types


def _check_depth(types, root, type_name):
    """Raise ValueError if a type holds itself, or types are nested too deep to be read."""
    depths = {}                             # of a type; None while it is being visited

    def visit(name, above):
        if above > LIMITS.schema_depth:
            raise ValueError(f'the definition of {type_name} is nested deeper than '
                             f'{LIMITS.schema_depth} types')
        if name in depths and depths[name] is None:
            raise ValueError(f'the definition of {type_name} is cyclic: {name} holds itself')
        if name not in depths:
            depths[name] = None
            depths[name] = 1 + max((visit(base, above + 1) for base in
                                    {m.base for m in types[name]} & set(types)), default=0)
        if above + depths[name] > LIMITS.schema_depth + 1:
            raise ValueError(f'the definition of {type_name} is nested deeper than '
                             f'{LIMITS.schema_depth} types')
        return depths[name]

    visit(root, 1)


def numeric_fields(type_name, text, limit=40):
    """Return the dotted paths of the numeric fields of a type; elements by index 0."""
    types = parse(type_name, text)
    found, empty = [], set()                # types without a number are visited once

    def visit(name, prefix):
        before = len(found)
        for m in types[name]:
            if len(found) >= limit:
                return
            path = prefix + m.name + ('' if m.plain else '[0]')
            if m.base in SIZES:
                found.append(path)
            elif m.base in types and m.base not in empty:
                visit(m.base, path + '.')
        if len(found) == before:
            empty.add(name)

    visit(short_name(type_name), '')
    return tuple(found)
