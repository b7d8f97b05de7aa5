"""
Move a model onto healthy recordings of the real spacecraft.

Every number that the model's `uncertainty` declares (frequency, damping, participation and shape
of every mode, inertia of the hub, gains and places of the sensors) goes to its most probable
value; of a model in .npz or .mat what its `uncertainty_...` declare. Levels of the inputs are free
in each recording; what a recorded input (--input) makes of it is predicted. What stays unknown is
kept with the model, and `ssi_ros diagnose --model CALIBRATED` counts with it. Several recordings
add their scatter. Exit code 0: the calibrated model explains the healthy recordings, 1: it does
not, and says what is not explained.
"""
from pathlib import Path

from ssi_ros.whole_file import write_whole

HELP = 'move a model onto healthy recordings'
EXAMPLE = 'ssi_ros calibrate healthy --output calibrated.yaml'
KINDS = (('frequency', 100.0, '%'), ('damping', 100.0, '%'), ('participation', 100.0, '%'),
         ('shape', 100.0, '%'), ('hub_inertia', 100.0, '%'), ('gain', 100.0, '%'),
         ('along', 1e3, 'mm'), ('lateral', 1e3, 'mm'))
MOVED = 2.0             # declared deviations from which an error is listed on its own
LISTED = 12


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._inputs import add_input
    from ssi_ros.cli._options import add_scale
    parser.add_argument('bags', type=Path, metavar='HEALTHY', nargs='+',
                        help='folders of bags without a fault, one or more')
    parser.add_argument('--model', metavar='FILE',
                        help='spacecraft YAML of the simulator, or .npz or .mat of any structure '
                        'with uncertainty_... (default: the packaged spacecraft)')
    parser.add_argument('--channel', action='append', metavar='TOPIC[:FIELD]',
                        help='with a model in .npz or .mat: a numeric field of the bags, in the '
                        'order of the channels of the model; repeatable')
    parser.add_argument('--output', type=Path, metavar='FILE', required=True,
                        help='write the calibrated model there, for --model of other verbs; .npz '
                        'for a model in .npz or .mat')
    add_input(parser)
    add_scale(parser)
    parser.add_argument('--settings', metavar='FILE', help='YAML as config/diagnosis.yaml')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write what moved there')
    parser.add_argument('--html', type=Path, metavar='FILE',
                        help='write a page there: spectra before and after, and residuals of '
                        'every recording over time')


def run(args):
    """Read, calibrate, print, write."""
    import json

    from ssi_ros.cli._inputs import inputs_of_each
    from ssi_ros.cli._options import Progress
    from ssi_ros.cli._samples import read_samples
    from ssi_ros.cli.diagnose import channels_of
    from ssi_ros.effects import load_configuration, save_configuration
    from ssi_ros.gap.settings import load_settings

    spacecraft, present = load_configuration(args.model)
    settings = load_settings(args.settings)
    if not spacecraft.arrays and args.output.suffix != '.npz':
        raise ValueError(f'--output {args.output} must end in .npz, the format that a model of '
                         'matrices is written in')
    if spacecraft.arrays and args.output.suffix not in ('.yaml', '.yml'):
        raise ValueError(f'--output {args.output} must end in .yaml, the format that a spacecraft '
                         'is written in')
    twice = [b for k, b in enumerate(args.bags) if b.resolve() in
             [other.resolve() for other in args.bags[:k]]]
    if twice:
        raise ValueError(f'{twice[0]} is given twice; each recording counts once')
    channels = channels_of(spacecraft, args.channel)
    with Progress('reading') as progress:
        recordings = [read_samples(b, spacecraft.rate_hz, channels, args.scale,
                                   staggered=not args.input, progress=lambda share, k=k: progress(
                                       (k + share) / len(args.bags)))
                      for k, b in enumerate(args.bags)]
    inputs = inputs_of_each(args.bags, args.input, spacecraft, recordings)
    with Progress('calibrating') as progress:
        # takes a second of its own
        from ssi_ros.updating.calibrate import calibrate
        found = calibrate(spacecraft, recordings, settings, names=[b.name for b in args.bags],
                          present=present, inputs=inputs, progress=progress)
    print(text(found, args.bags))
    save_configuration(found.spacecraft, present, args.output)
    print(f'wrote {args.output}')
    if args.json:
        write_whole(args.json, json.dumps(plain(found, args.bags), indent=1) + '\n')
    if args.html:
        from ssi_ros.report.calibration_page import calibration_page
        write_whole(args.html, calibration_page(
            found, spacecraft, recordings, settings, present, list(map(str, args.bags))))
        print(f'wrote {args.html}')
    return 0 if found.explains else 1


def text(found, bags):
    """Return what moved: a line a kind of number, and the numbers that moved most."""
    lines = [f'{bag}: {lost.text}' for bag, lost in zip(bags, found.missing)]
    lines += list(found.notes)
    many = len(bags) > 1                # the scatter from recording to recording needs two
    lines += [f'{"":<16}{"moved (rms)":>14}{"declared":>12}{"remains":>12}'
              + f'{"scatter":>12}' * many]
    for kind, scale, unit in KINDS:
        own = [m[1:] for m in found.moved if m.name.split()[0] == kind]
        if own:
            value, declared, remains, scatter = (
                scale * (sum(c * c for c in column) / len(own)) ** 0.5 for column in zip(*own))
            lines.append(f'{kind:<16}{value:>12.3g} {unit}' + ''.join(
                f'{v:>10.3g} {unit}' for v in (declared, remains, scatter)[:2 + many]))
    for name, value, declared, remains, _ in found.moved[:LISTED]:
        if abs(value / declared) >= MOVED:
            scale, unit = next((s, u) for k, s, u in KINDS if k == name.split()[0])
            lines.append(f'{name}: {scale * value:+.3g} {unit}, {value / declared:+.1f} declared '
                         f'deviations, known to {scale * remains:.2g} {unit}')
    for bag, check in zip(bags, found.checks):
        lines.append(f'{bag}: gap {check.before:.4f} nats a band before, {check.after:.4f} after, '
                     f'{check.deviations:.1f} standard deviations above its floor')
        lines += [f'{bag}: not explained: {words}' for words in check.detected]
    lines.append('the calibrated model explains the healthy recordings' if found.explains else
                 'the calibrated model does not explain all of the healthy recordings; every '
                 'diagnosis with it will say so')
    return '\n'.join(lines)


def plain(found, bags):
    """Return the same as plain data."""
    return {
        'schema': 'ssi_ros/calibration/1',
        'errors': [dict(zip(('name', 'value', 'declared_std', 'std', 'scatter'),
                            (m.name, *map(float, m[1:])))) for m in found.moved],
        'levels': [levels.tolist() for levels in found.fit.levels],
        'recordings': [{'bag': str(b), 'gap_before': float(c.before), 'gap_after': float(c.after),
                        'deviations': float(c.deviations), 'p_value': float(c.p_value),
                        'unexplained': list(c.detected), 'missing': {**vars(m), 'text': m.text}}
                       for b, c, m in zip(bags, found.checks, found.missing)],
        'left_out': list(found.notes),
        'explains': bool(found.explains)}
