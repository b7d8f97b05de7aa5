"""
A number declared once: default, unit, range and meaning.

The one declaration serves the range check, the YAML loader, the ROS parameter descriptor, the
fit bounds and the tables of the documentation.
"""
from dataclasses import dataclass, field, fields, is_dataclass, MISSING
import difflib
import math


@dataclass(frozen=True)
class Threshold:
    """A limit of a decision, with its origin."""

    value: float
    unit: str       # '1' for a pure number
    source: str     # equation, paper, command that calibrated it, or why an engineer chooses it


def choice(value, unit, why):
    """Return a limit that an engineer has chosen."""
    return Threshold(value, unit, f'engineering choice: {why}')


def quantity(default, *, unit='1', low=-math.inf, high=math.inf, doc='', live=True):
    """
    Declare one quantity of a record.

    Parameters
    ----------
    default : float, int, bool, str or tuple
        Value when none is given.
    unit : str
        SI unit, '1' for a pure number.
    low, high : float
        Closed range allowed.
    doc : str
        One line that says what the quantity is.
    live : bool
        Whether a running node accepts a change.

    Returns
    -------
    dataclasses.Field

    """
    return field(default=default, metadata={
        'unit': unit, 'low': low, 'high': high, 'doc': doc, 'live': live})


def quantities(record):
    """Return the fields of a record (or its class) that were declared by `quantity`."""
    return tuple(f for f in fields(record) if 'unit' in f.metadata)


def check(record):
    """
    Check every quantity of a record against its declaration.

    Raises
    ------
    ValueError
        With the name, the value given, the range allowed and what it is.

    """
    for f in quantities(record):
        value = getattr(record, f.name)
        values = value if isinstance(value, (tuple, list)) else (value,)
        if values is value and isinstance(f.default, (bool, int, float, str)):
            raise ValueError(f'{f.name}={value!r:.60} must be one value, not several: '
                             f'{f.metadata["doc"]}')
        for v in values:
            check_value(f, v)


def check_value(f, value):
    """Check one scalar against the declaration of a field, ValueError if it is out of range."""
    sample = f.default[0] if isinstance(f.default, tuple) and f.default else f.default
    if isinstance(sample, bool) or isinstance(sample, str):
        if not isinstance(value, type(sample)):
            raise ValueError(f'{f.name}={value!r} must be a {type(sample).__name__}: '
                             f'{f.metadata["doc"]}')
        return
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f'{f.name}={value!r} must be a number [{f.metadata["unit"]}]: '
                         f'{f.metadata["doc"]}')
    if isinstance(sample, int) and value != int(value):
        raise ValueError(f'{f.name}={value!r} must be a whole number: {f.metadata["doc"]}')
    low, high = f.metadata['low'], f.metadata['high']
    if not low <= value <= high:      # a NaN fails here too
        raise ValueError(f'{f.name}={value:g} is outside {low:g} to {high:g} '
                         f'[{f.metadata["unit"]}]: {f.metadata["doc"]}')


def in_range(cls, values):
    """Return whether numbers among values, by name, lie where the class `cls` declares them."""
    return all(f.metadata['low'] <= values[f.name] <= f.metadata['high']
               for f in quantities(cls)
               if f.name in values and not isinstance(values[f.name], str))


def from_mapping(cls, mapping, where=''):
    """
    Build a record of class `cls` from plain data, such as a YAML file.

    Nested records are built from nested mappings; lists become tuples.

    Raises
    ------
    ValueError
        For a key that the record does not have (the near names are listed), or a missing one.

    """
    if not isinstance(mapping, dict):
        named = (where or cls.__name__).rstrip(': ')
        raise ValueError(f'{named} must be a mapping of names to values, not {mapping!r:.60}')
    known = {f.name: f for f in fields(cls)}
    for key in mapping:
        if key not in known:
            raise ValueError(unknown(f'{where}{key}', key, known))
    values = {}
    for name, f in known.items():
        if name in mapping:
            values[name] = _plain_to(f, mapping[name], f'{where}{name}.')
        elif f.default is MISSING and f.default_factory is MISSING:
            raise ValueError(f'{where}{name} is missing; {cls.__name__} needs '
                             + ', '.join(known))
    return cls(**values)


def defaulted(cls, mapping, where=''):
    """Return the dotted names of the numbers of a record that plain data leaves to defaults."""
    names = []
    for f in fields(cls):
        record, value = f.metadata.get('record'), mapping.get(f.name)
        if f.name not in mapping:
            names += [where + f.name] if record is None else []
        elif record is not None:
            for i, part in enumerate(value if isinstance(value, list) else [value]):
                place = f'{where}{f.name}.{i}.' if isinstance(value, list) else f'{where}{f.name}.'
                names += defaulted(record, part, place) if isinstance(part, dict) else []
    return names


def unknown(given, key, known):
    """Say that a name is not known, and which ones are near or allowed."""
    near = difflib.get_close_matches(str(key), list(known), n=3)
    hint = f'did you mean {" or ".join(near)}?' if near else 'known: ' + ', '.join(known)
    return shown(f'{given} is not known; {hint}')


def _plain_to(f, value, where):
    record = f.metadata.get('record')
    if record is not None and isinstance(value, (list, tuple)):
        return tuple(from_mapping(record, v, f'{where}{i}.') for i, v in enumerate(value))
    if record is not None:
        return from_mapping(record, value, where)
    if isinstance(value, list):
        return tuple(value)
    if isinstance(f.default, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return value


def to_mapping(record):
    """Turn a record into plain data that `from_mapping` takes back."""
    if hasattr(record, 'to_plain'):
        return record.to_plain()
    if is_dataclass(record):
        return {f.name: to_mapping(getattr(record, f.name)) for f in fields(record)}
    if isinstance(record, (tuple, list)):
        return [to_mapping(v) for v in record]
    return record


def with_spread(value, std, digits, mark='+-'):
    """
    Return a number and its standard deviation as text, the latter with two significant digits.

    Parameters
    ----------
    value, std : float
        Of the same unit; where `std` is not finite or not positive the number stands alone.
    digits : int
        Decimals of a number that stands alone.
    mark : str
        What stands between the two.

    Returns
    -------
    str
        '15.8271 +- 0.0064'; never '-0.00'.

    """
    known = math.isfinite(std) and std > 0.0
    if known:
        # of the rounded spread: 0.0996 is printed 0.10
        digits = min(9, max(0, 1 - math.floor(math.log10(float(f'{std:.1e}')))))
    text = fixed(value, digits)
    return f'{text} {mark} {std:.{digits}f}' if known else text


def fixed(value, digits, sign=''):
    """Return a number with so many decimals; '-' where there is none, and never '-0.00'."""
    if not math.isfinite(value):
        return '-'
    text = f'{value:{sign}.{digits}f}'
    return text.replace('-', sign) if float(text) == 0.0 else text


def probability_text(probability):
    """Return a probability with two digits; never 1.00 or 0.00 for what is not certain."""
    if probability > 0.99:
        return '> 0.99'
    return f'{probability:.2f}' if probability >= 0.01 else '< 0.01'


def p_value_text(p_value):
    """Return a p-value with two digits, '< 1e-15' below what arithmetic can say."""
    return '< 1e-15' if p_value < 1e-15 else f'{p_value:.2g}'


def p_equation(p_value):
    """Return a p-value in a sentence, 'p = 0.02' or 'p < 1e-15'."""
    text = p_value_text(p_value)
    return f'p {text}' if text.startswith('<') else f'p = {text}'


def things(n, noun):
    """Return a number of things in words: 1 channel, 4 channels."""
    return f'{n} {noun}' if n == 1 else f'{n} {noun}s'


def shown(text):
    """Return words of a file for one line of a terminal: what does not print is escaped."""
    return ''.join(c if c.isprintable() else c.encode('unicode_escape').decode()
                   for c in str(text))
