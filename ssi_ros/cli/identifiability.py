"""
List which effects a record would show, before it is made.

For every effect and place: the size probed, d', the standard deviations of its score in a record
of this length, the size at d' = 4 (detected nine times in ten), and the effects most like it. A
cosine above 0.95 means that the record distinguishes the two only beyond about d' = 8: they are
one class. Rounding, clipping and missing rows show in the samples at any size.

d' counts with what the model does not know of its own numbers: its `uncertainty:`, or what a
calibration has left. `if exact` is d' for a model without errors: where it is much larger, errors
of the model imitate the effect, and a calibration on a healthy recording would help.

With --input, an input of the model is recorded beside the channels: `without` is d' of the same
effect where it is not, and `times` by how much recording raises that of a small effect. It takes
some fifteen seconds for a model with a hundred uncertain numbers.
"""
from pathlib import Path

from ssi_ros.whole_file import write_whole

HELP = 'which effects a record of a given length would show and distinguish'
EXAMPLE = 'ssi_ros identifiability --duration-s 600'
MOST_TIMES = 1000       # by which a recorded input raises d', as it is written
INPUT = ('an input of the model that will be recorded, by its name (torque_x) or as `diagnose '
         '--input` will have it (/input/torque_x:wrench.torque.x); repeatable')


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--model', metavar='FILE',
                        help='spacecraft YAML, or .npz or .mat of any structure (default: the '
                        'packaged spacecraft)')
    parser.add_argument('--duration-s', type=float, default=600.0,
                        help='length of the record [s] (default: 600)')
    parser.add_argument('--input', action='append', metavar='NAME', help=INPUT)
    parser.add_argument('--json', type=Path, metavar='FILE', help='write table and classes there')
    parser.add_argument('--html', type=Path, metavar='FILE',
                        help='write a page with the table and the matrix of cosines')
    parser.add_argument('--settings', metavar='FILE', help='YAML as config/diagnosis.yaml')


def run(args):
    """Print the table."""
    import json
    import sys

    from ssi_ros.cli._options import Progress
    from ssi_ros.cli._table import fitted
    from ssi_ros.effects import load_configuration
    from ssi_ros.gap.settings import load_settings
    from ssi_ros.planning.identifiability import classes, identifiability
    from ssi_ros.planning.rows import cosines, rows_of

    settings = load_settings(args.settings)
    model = load_configuration(args.model)[0]
    inputs = planned(model, args.input)
    with Progress('computing') as progress:
        found = identifiability(model, args.duration_s, settings, progress, inputs=inputs)
    if inputs:
        print(f'recorded: {", ".join(inputs)}')
    groups, rows = classes(found, settings.tie_cosine), rows_of(found)
    print(fitted(_table(rows, settings.tie_cosine, bool(inputs)), sys.stdout))
    print('\nnot distinguished up to about 8 standard deviations:')
    for group, ways in groups:
        print(f'  {", ".join(group)}; what would distinguish them: {"; ".join(ways)}')
    names, matrix = cosines(found)
    if args.html:
        from ssi_ros.report.identifiability_page import identifiability_page
        write_whole(args.html, identifiability_page(
            rows, groups, (names, matrix), args.duration_s, args.model or '', inputs))
        print(f'wrote {args.html}')
    if args.json:
        plain = {
            'schema': 'ssi_ros/identifiability/1', 'duration_s': args.duration_s,
            'inputs': list(inputs),
            'classes': [list(group) for group, _ in groups],
            'separate_by': [list(ways) for _, ways in groups],
            'cosines': {'effects': list(names), 'matrix': matrix.round(4).tolist()},
            'effects': [{'effect': v.effect.text(), 'name': v.effect.name,
                         'detection': v.detection if v.detection == v.detection else None,
                         'exact': v.exact if v.exact == v.exact else None,
                         'without_inputs': v.without if v.without == v.without else None,
                         'seen': v.seen.text() if v.seen else None,
                         'alike': [[n, c] for n, c in v.alike]} for v in found]}
        write_whole(args.json, json.dumps(plain, indent=1) + '\n')
    return 0


def planned(model, given):
    """Return the inputs of a model that an option names; ValueError for one that it has not."""
    from ssi_ros.cli._inputs import input_of
    names = []
    for text in given or ():
        words, _, name = text.partition('=')
        topic, _, field = words.partition(':')
        names.append(input_of(model, name or None if words.startswith('/') else words, topic,
                              field))
    return tuple(dict.fromkeys(names))


def _table(rows, limit, inputs):
    """Return the rows as text in columns; (tied) where effects are one class."""
    from ssi_ros.report.parts import deviations
    heads = ['effect', "d'", *(['without', 'times'] if inputs else []), 'if exact',
             "size at d' = 4", 'at', 'probed', 'most alike (cosine)']
    lines = [[r.name, deviations(r.detection),
              *([deviations(r.without), _times(r)] if inputs else []),
              deviations(r.exact), r.seen, r.where, r.probed,
              ', '.join(f'{n} {c:.2f}' + ' (tied)' * (c > limit) for n, c in r.alike)]
             for r in rows]
    widths = [max(len(line[k]) for line in (heads, *lines)) for k in range(len(heads))]
    right = {k for k, h in enumerate(heads) if h in ("d'", 'without', 'times', 'if exact')}
    return '\n'.join('  '.join(
        cell.rjust(w) if k in right else cell.ljust(w)
        for k, (cell, w) in enumerate(zip(line, widths))).rstrip() for line in (heads, *lines))


def _times(row):
    """Return by how much recorded inputs raise d'."""
    if row.without != row.without:
        return '-'
    return (f'{row.detection / row.without:.2f}' if row.detection < MOST_TIMES * row.without
            else f'> {MOST_TIMES}')
