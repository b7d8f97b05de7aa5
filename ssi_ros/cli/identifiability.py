"""
Say what a record could tell, before it is made.

For every effect and place: the size probed, how many standard deviations of its score that gives
in a record of this length (4 is a sure detection), and the effects that look most like it (a
cosine over 0.98 means that the record cannot part the two). Effects that show only in the samples
and not in a spectrum (steps, rails, losses, jolts) are seen by tests of their own.
"""
HELP = 'which effects a record of a given length could show and part'
EXAMPLE = 'ssi_ros identifiability --duration-s 600'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--model', metavar='FILE',
                        help='spacecraft YAML (default: the packaged one)')
    parser.add_argument('--duration-s', type=float, default=600.0,
                        help='length of the record [s] (default: 600)')
    parser.add_argument('--settings', metavar='FILE', help='YAML as config/diagnosis.yaml')


def run(args):
    """Print the table."""
    from ssi_ros.cli._options import Progress
    from ssi_ros.effects import load_configuration
    from ssi_ros.gap.identifiability import identifiability
    from ssi_ros.gap.settings import load_settings

    settings = load_settings(args.settings)
    with Progress('computing') as progress:
        found = identifiability(load_configuration(args.model)[0], args.duration_s, settings,
                                progress)
    print(f'{"d":>7}  effect, place and size probed; most alike (cosine)')
    for v in found:
        near = ', '.join(f'{n} {c:.2f}' + (' TIED' if c > settings.tie_cosine else '')
                         for n, c in v.alike)
        print(f'{v.detection:>7.1f}  {v.effect.text()}; {near}')
    return 0
