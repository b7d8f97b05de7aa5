"""
MkDocs hook: typeset the equations of the pages as MathML when the site is built.

Equations stand in the Markdown as LaTeX: `$...$` in a sentence, and on lines of their own

    $$
    E = m c^2
    \\tag{105b}
    $$

Browsers show MathML by themselves, so the site needs no script for them and nothing from outside.
LaTeX that cannot be converted ends the build. A numbered equation has the anchor `#eq-105b`.
"""
from html import unescape
import re

from math_core import LatexToMathML

CONVERTER = LatexToMathML(fancy_error=False)
BLOCK = re.compile(r'<div class="arithmatex">\\\[(.*?)\\\]</div>', re.S)
INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.S)
TAG = re.compile(r'\\tag\{(\w+)\}')


def displayed(match):
    """Return a displayed equation that scrolls where it is wide, its number at the right edge."""
    latex = unescape(match[1])
    numbers = TAG.findall(latex)
    math = CONVERTER.convert_with_local_state(TAG.sub('', latex).strip(), displaystyle=True)
    if not numbers:
        return f'<div class="equation"><div>{math}</div></div>'
    number, = numbers
    return (f'<div class="equation" id="eq-{number}"><div>{math}</div>'
            f'<a href="#eq-{number}">({number})</a></div>')


def inline(match):
    """Return an equation inside a sentence."""
    return CONVERTER.convert_with_local_state(unescape(match[1]), displaystyle=False)


def on_page_content(html, **_):
    """Replace what `pymdownx.arithmatex` marked as LaTeX."""
    return INLINE.sub(inline, BLOCK.sub(displayed, html))
