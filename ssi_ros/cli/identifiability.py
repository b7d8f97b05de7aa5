"""
Say what a record could tell, before it is made.

For every effect and place: the size probed, how many standard deviations of its score that gives
in a record of this length, the size that gives 4 of them (an effect so large is seen nine times in
ten), and the effects that look most like it. A cosine over 0.95 means that the record parts the
two only beyond about 8 standard deviations: they are one class. Rounding, rails and missing rows
show in the samples at any size.
"""
from pathlib import Path

HELP = 'which effects a record of a given length could show and part'
EXAMPLE = 'ssi_ros identifiability --duration-s 600'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--model', metavar='FILE',
                        help='spacecraft YAML (default: the packaged one)')
    parser.add_argument('--duration-s', type=float, default=600.0,
                        help='length of the record [s] (default: 600)')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write table and classes there')
    parser.add_argument('--settings', metavar='FILE', help='YAML as config/diagnosis.yaml')


def run(args):
    """Print the table."""
    import json

    from ssi_ros.cli._options import Progress
    from ssi_ros.effects import load_configuration
    from ssi_ros.gap.identifiability import classes, identifiability
    from ssi_ros.gap.settings import load_settings

    settings = load_settings(args.settings)
    with Progress('computing') as progress:
        found = identifiability(load_configuration(args.model)[0], args.duration_s, settings,
                                progress)
    groups = classes(found, settings.tie_cosine)
    print(f'{"d":>7}  effect, place and size probed; size seen at d = 4; most alike (cosine)')
    for v in found:
        near = ', '.join(f'{n} {c:.2f}' + (' TIED' if c > settings.tie_cosine else '')
                         for n, c in v.alike)
        print(f'{v.detection:>7.1f}  {v.effect.text()}; {_seen(v)}; {near}')
    print('\nnot to be told apart up to about 8 standard deviations:')
    for group, parted in groups:
        print(f'  {", ".join(group)}; would part them: {"; ".join(parted)}')
    if args.json:
        args.json.write_text(json.dumps({
            'schema': 'ssi_ros/identifiability/1', 'duration_s': args.duration_s,
            'classes': [list(group) for group, _ in groups],
            'separate_by': [list(parted) for _, parted in groups],
            'effects': [{'effect': v.effect.text(), 'name': v.effect.name,
                         'detection': v.detection if v.detection == v.detection else None,
                         'seen': v.seen.text() if v.seen else None,
                         'alike': [[n, c] for n, c in v.alike]} for v in found]}, indent=1)
            + '\n')
    return 0


def _seen(visible):
    if visible.seen is None:
        return 'any size'
    size = visible.effect.size
    return f'{size}={getattr(visible.seen, size):.4g}'
