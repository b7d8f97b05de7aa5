"""The same sections as Markdown, for a terminal or a merge request; pictures are left out."""


def markdown(title, summary, sections):
    """Return sections as Markdown text; see `page`."""
    parts = [f'# {title}', '']
    if summary:
        parts += [f'**{summary}**', '']
    for s in sections:
        parts += [f'## {s.title}', '']
        for line in s.lines:
            parts += [line, '']
        for t in s.tables:
            parts += _table(t) + ['']
        if s.commands:
            parts += ['```sh', *s.commands, '```', '']
    return '\n'.join(parts).rstrip() + '\n'


def _table(table):
    rows = [[str(c).replace('|', r'\|') for c in r] for r in (table.heads, *table.rows)]
    widths = [max(len(r[k]) for r in rows) for k in range(len(table.heads))]

    def line(cells):
        return '| ' + ' | '.join(c.ljust(w) for c, w in zip(cells, widths)) + ' |'
    out = [table.caption + ':', ''] if table.caption else []
    return out + [line(rows[0]), '|' + '|'.join('-' * (w + 2) for w in widths) + '|',
                  *map(line, rows[1:])]
