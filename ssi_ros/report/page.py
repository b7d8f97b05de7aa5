"""
One HTML page that needs no network: text, tables, and pictures that draw themselves.

Plotly and the pictures are packed with gzip, which browsers unpack since 2023; that keeps a page
near 2 MB where Plotly alone has almost 5.
"""
import base64
from functools import lru_cache
import gzip
import html
from importlib.resources import files
import json
import re

from ssi_ros import __version__

WORDS, _LONG = 40, ' class="long"'       # letters of a cell from which on it may be broken
_MINUS = re.compile(r'(?<= )-(?=[a-zA-Z])')    # before the name of a channel


def page(title, summary, sections):
    """
    Return the page as text.

    Parameters
    ----------
    title : str
        Heading.
    summary : str
        The answer in one sentence, shown in a frame; empty for none.
    sections : sequence of Section
        In the order of reading.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        If two pictures have the same name.

    """
    pictures = [p for s in sections for p in s.pictures]
    names = [p.name for p in pictures]
    if len(set(names)) < len(names):
        raise ValueError(f'two pictures have one name among {names}; rename one')
    own = files('ssi_ros.report')
    head = (f'<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" '
            f'content="width=device-width, initial-scale=1"><title>{html.escape(title)}</title>'
            f'<style>{own.joinpath("page.css").read_text()}</style></head><body>')
    parts = [head, f'<h1>{html.escape(title)}</h1>']
    if summary:
        parts.append(f'<div class="verdict">{_text(summary)}</div>')
    parts.append('<p id="trouble"><noscript>Text and tables are complete; the pictures need '
                 'JavaScript.</noscript></p><nav>' + ' '.join(
                     f'<a href="#s{i}">{html.escape(s.title)}</a>'
                     for i, s in enumerate(sections)) + '</nav>')
    parts += [_section(i, s) for i, s in enumerate(sections)]
    parts.append(f'<footer>Made by ssi_ros {__version__}. Lines differ by dash and width, bars '
                 'carry their numbers: no picture needs colour to be read. #all behind the '
                 'address draws every picture at once.</footer>')
    parts.append(_packed('plotly', _plotly()) + _packed('pictures', _pack(_json(pictures))))
    parts.append(f'<script>{own.joinpath("page.js").read_text()}</script></body></html>\n')
    return '\n'.join(parts)


def _section(i, section):
    parts = [f'<section id="s{i}"><h2>{html.escape(section.title)}</h2>']
    parts += [f'<p>{_text(line)}</p>' for line in section.lines]
    parts += [_table(t) for t in section.tables]
    if section.commands:
        parts.append(f'<pre>{html.escape(chr(10).join(section.commands))}</pre>')
    parts.append('<div class="pictures">')
    for p in section.pictures:
        height, wide = p.figure.layout.height, '' if p.half else ' class="wide"'
        size = f'height:{height}px' + (f';min-width:{p.least_px}px' if p.least_px else '')
        parts.append(f'<figure{wide}><div class="scroll"><div class="picture" id="{p.name}" '
                     f'style="{size}"></div></div><figcaption>{_text(p.caption)}'
                     '</figcaption></figure>')
    return '\n'.join(parts) + '</div></section>'


def _text(words):
    """Return words for a page: signs as they are typeset, and a minus that no line ends on."""
    return _MINUS.sub('\u2011', html.escape(str(words)).replace(' +- ', ' ± '))


def _table(table):
    def row(tag, cells):
        return '<tr>' + ''.join(
            f'<{tag}{_LONG if len(str(c)) > WORDS else ""}>{_text(c)}</{tag}>'
            for c in cells) + '</tr>'
    # beside the table, not in it: on a telephone the table is scrolled, and its caption wraps
    caption = f'<p class="caption">{_text(table.caption)}</p>' if table.caption else ''
    return (caption + '<div class="scroll"><table>' + row('th', table.heads)
            + ''.join(row('td', r) for r in table.rows) + '</table></div>')


def _json(pictures):
    from plotly.io.json import to_json_plotly
    found = {p.name: json.loads(to_json_plotly(p.figure)) | {'motion': p.motion}
             for p in pictures}
    return json.dumps(found, separators=(',', ':')).encode()


@lru_cache(maxsize=1)
def _plotly():
    return _pack((files('plotly') / 'package_data' / 'plotly.min.js').read_bytes())


def _pack(data):
    # without the time of day: the same record makes the same page
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


def _packed(name, text):
    return f'<script type="text/plain" id="{name}">{text}</script>'
