"""Colour of words that matter, on a terminal only; NO_COLOR turns it off (no-color.org)."""
import os
import re

STYLES = {
    'structural': '32', 'EXPLAINED': '32', 'WITHIN_FLOOR': '32', 'ok': '32',
    'undecided': '33', 'TIED': '33', 'warn': '33',
    'input_line': '36',
    'not found': '31', 'UNEXPLAINED': '31', 'TOO_LITTLE_DATA': '31', 'error': '31'}
_LABELS = re.compile(r'\b(' + '|'.join(k for k in STYLES if len(k) > 5 or k.isupper()) + r')\b')


def wants_colour(stream):
    """Return whether a stream is a terminal that may be coloured."""
    return (stream.isatty() and not os.environ.get('NO_COLOR')
            and os.environ.get('TERM') != 'dumb')


def painted(text, style, stream):
    """Return text in the style of one of `STYLES`, as it is where the stream takes no colour."""
    return f'\033[{STYLES[style]}m{text}\033[0m' if wants_colour(stream) else text


def coloured(text, stream):
    """Return text with its labels and outcomes in colour."""
    if not wants_colour(stream):
        return text
    return _LABELS.sub(lambda m: painted(m[0], m[0], stream), text)
