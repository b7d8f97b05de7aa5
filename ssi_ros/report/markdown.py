"""
The same sections as Markdown, for a terminal or a merge request, without the pictures.

Names come out of a bag: what they hold must not become a heading, a link, a tag or another row.
"""
import re

_SPECIAL = re.compile(r'([\\`<\[])')
_BLOCK = re.compile(r'^([#>+-]|\d+[.)])(?=\s|$)')


def markdown(title, summary, sections):
    """Return sections as Markdown text; see `page`."""
    parts = [f'# {_words(title)}', '']
    if summary:
        parts += [f'**{_words(summary)}**', '']
    for s in sections:
        parts += [f'## {_words(s.title)}', '']
        for line in s.lines:
            parts += [_BLOCK.sub(r'\\\1', _words(line)), '']
        for t in s.tables:
            parts += _table(t) + ['']
        if s.commands:
            parts += ['```sh', *(_one_line(c).replace('`', "'") for c in s.commands), '```', '']
    return '\n'.join(parts).rstrip() + '\n'


def _one_line(text):
    return ' '.join(str(text).splitlines())


def _words(text):
    """Return text on one line, with what Markdown takes for more than words escaped."""
    return _SPECIAL.sub(r'\\\1', _one_line(text))


def _table(table):
    rows = [[_words(c).replace('|', r'\|') for c in r] for r in (table.heads, *table.rows)]
    widths = [max(len(r[k]) for r in rows) for k in range(len(table.heads))]

    def line(cells):
        return '| ' + ' | '.join(c.ljust(w) for c, w in zip(cells, widths)) + ' |'
    out = [_words(table.caption) + ':', ''] if table.caption else []
    return out + [line(rows[0]), '|' + '|'.join('-' * (w + 2) for w in widths) + '|',
                  *map(line, rows[1:])]
