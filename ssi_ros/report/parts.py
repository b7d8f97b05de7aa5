"""What a report is made of: sections of text, tables, pictures and commands, plain data."""
from dataclasses import dataclass
import math

from ssi_ros.quantity import fixed


@dataclass(frozen=True)
class Table:
    """Heads and rows of text; the caption says what the numbers are."""

    heads: tuple
    rows: tuple
    caption: str = ''


@dataclass(frozen=True, eq=False)
class Picture:
    """
    A Plotly figure with the sentence that says what to see in it.

    Attributes
    ----------
    name : str
        Name of its place on the page.
    figure : plotly.graph_objects.Figure
        The figure.
    caption : str
        What is drawn, and what to note in it.
    motion : dict or None
        What `page.js` moves in it, see `spacecraft_3d.py`.
    half : bool
        Whether half the width of the page is enough.
    least_px : int
        Width below which it is scrolled, not squeezed.

    """

    name: str
    figure: object
    caption: str
    motion: dict = None
    half: bool = False
    least_px: int = 0


@dataclass(frozen=True)
class Section:
    """One question and its answer."""

    title: str
    lines: tuple = ()
    tables: tuple = ()
    pictures: tuple = ()
    commands: tuple = ()


def number(value, digits=3):
    """Return a number as text of so many significant digits; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return '-'
    return f'{value:.{digits}g}'


def percent(share, digits=0):
    """Return a share as a percentage; a dash where there is none, never a false 0 or 100 %."""
    if share is None or not math.isfinite(share):
        return '-'
    least = 0.5 * 10.0 ** -digits / 100
    if 0.0 < share < least:
        return f'< {200 * least:g} %'
    if 1.0 - least < share < 1.0:
        return f'> {100 - 200 * least:g} %'
    if abs(share) < least:
        return f'{0:.{digits}f} %'           # not -0
    return f'{100 * share:.{digits}f} %'


def deviations(value):
    """Return standard deviations as text: a decimal below a hundred, '-' where there are none."""
    return fixed(value, 1 if abs(value) < 100.0 else 0)


def measured(value, unit, digits=5):
    """Return a number with its unit; a pure number alone, parts per million as times 1e-6."""
    text = '' if unit == '1' else f' × {unit}' if unit[:1].isdigit() else f' {unit}'
    return number(value, digits) + text
