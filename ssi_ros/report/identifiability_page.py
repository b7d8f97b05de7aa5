"""What a record would show as one HTML page: sizes, classes, and the matrix of cosines."""
import numpy as np

from ssi_ros.report.page import page
from ssi_ros.report.parts import deviations, Picture, Section, Table
from ssi_ros.report.style import heat

WRITTEN = 0.1           # cosines that are written into their fields


def identifiability_page(rows, groups, likeness, duration_s, model='', inputs=()):
    """
    Return the page as text.

    Parameters
    ----------
    rows : sequence of Row
        Of `planning.rows`.
    groups : sequence of (tuple of str, tuple of str)
        Effects that are not distinguished, and what would distinguish them.
    likeness : (tuple of str, ndarray of shape (n, n))
        Names of effects and the cosines of their scores.
    duration_s : float
        Of the record that is planned [s].
    model : str
        What was given, '' for the packaged spacecraft.
    inputs : sequence of str
        Recorded ones.

    Returns
    -------
    str

    """
    # what a narrow screen shows stands first
    heads = ['effect', "d'", *(['without input'] if inputs else []), 'if exact',
             "size at d' = 4", 'probed', 'at']
    table = Table(tuple(heads), tuple(
        (r.name, deviations(r.detection), *([deviations(r.without)] if inputs else []),
         deviations(r.exact), r.seen, r.probed, r.where)
        for r in rows),
        "d': standard deviations of the score in such a record; if exact: d' if all numbers of "
        'the model were exact. Places with the same numbers share a row')
    names, matrix = likeness
    picture = heat(np.round(matrix, 3), list(names), list(names), 'Cosines of the scores',
                   limit=1.0, height=220 + 26 * len(names), texts=[
                       [f'{c:.2f}' if c >= WRITTEN else '' for c in row] for row in matrix])
    picture.update_xaxes(tickangle=-60, automargin=True)
    sure = [r.name for r in rows if r.detection >= 4.0 or r.detection != r.detection]
    kinds = len({r.name for r in rows})
    return page(
        f'What a record of {duration_s:g} s would show' + (f' of {model}' if model else ''),
        f"{len(set(sure))} of {kinds} effects would be detected at the size probed (d' of 4 or "
        f'more); {len(groups)} classes of effects are not distinguished up to about 8 standard '
        'deviations.', (
            Section('From which size on is an effect seen?', (), (table,)),
            Section('Which effects look alike?', () if groups else (
                'All effects are distinguished.',), (Table(
                    ('not distinguished', 'what would distinguish them'),
                    tuple((', '.join(g), '; '.join(ways)) for g, ways in groups)),)
                if groups else (), (Picture(
                    'cosines', picture, 'The largest cosine over places and starting values: 1 '
                    'for effects that change a record in the same way, 0 for effects that have '
                    f'nothing in common; below {WRITTEN:g} the field is empty.',
                    least_px=160 + 34 * len(names)),) if len(names) > 1 else ())))
