"""
Diagnose the gap between a simulator and a recording.

It says whether there is a gap, where it lies, which unmodelled effect causes it and how sure that
is, and how far the gap shrinks on data that the fit did not see. Exit code 0: the record is
explained (or there is no gap), 1: it is not.
"""
from pathlib import Path

HELP = 'find which unmodelled effect parts a bag from the model'
EXAMPLE = 'ssi_ros diagnose quiet --json diagnosis.json'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('bag', type=Path, metavar='BAG', nargs='?', help='folder of the bag')
    parser.add_argument('--many', type=Path, metavar='FOLDER',
                        help='diagnose every bag below this folder on a Dask cluster; the same '
                        'command goes on where it was stopped; --json then names a folder')
    parser.add_argument('--workers', type=int, metavar='N',
                        help='with --many: processes on this machine (default: one a core)')
    parser.add_argument('--scheduler', metavar='tcp://...',
                        help='with --many: a running Dask scheduler in place of own processes')
    parser.add_argument('--model', metavar='FILE',
                        help='spacecraft YAML of the simulator (default: the packaged one)')
    parser.add_argument('--reference', type=Path, metavar='BAG0',
                        help='take another bag of the same structure for nominal, not a model')
    parser.add_argument('--channel', action='append', metavar='TOPIC[:FIELD]',
                        help='with --reference: a numeric field of both bags, repeatable '
                        '(default: accel.linear.z of every AccelStamped topic)')
    parser.add_argument('--settings', metavar='FILE', help='YAML as config/diagnosis.yaml')
    parser.add_argument('--effects', metavar='A,B', help='consider only these effects')
    parser.add_argument('--no-pairs', action='store_true',
                        help='do not look for two effects at once')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write the diagnosis there')
    parser.add_argument('--html', type=Path, metavar='FILE',
                        help='write a page with pictures there; it needs no network')
    parser.add_argument('--markdown', type=Path, metavar='FILE',
                        help='write the same as Markdown, without the pictures')
    parser.add_argument('--apply', type=Path, metavar='FILE',
                        help='write a configuration of the simulator with the effect in it')


def run(args):
    """Read, diagnose, print, write."""
    import json

    from ssi_ros.cli._options import Progress
    from ssi_ros.cli._samples import read_samples
    from ssi_ros.effects import load_configuration, save_configuration
    from ssi_ros.gap.diagnose import diagnose
    from ssi_ros.gap.settings import load_settings

    if (args.bag is None) == (args.many is None):
        raise ValueError('give one bag, or --many FOLDER')
    if args.many is not None:
        from ssi_ros.cli._many import run_many
        return run_many(args)
    if args.workers is not None or args.scheduler is not None:
        raise ValueError('--workers and --scheduler belong to --many')
    if args.reference is not None:
        return run_against_reference(args)
    if args.channel:
        raise ValueError('--channel belongs to --reference; a model names its own channels')
    spacecraft, present = load_configuration(args.model)
    names = [n.strip() for n in args.effects.split(',')] if args.effects else None
    samples = read_samples(args.bag, spacecraft.rate_hz)
    with Progress('diagnosing') as progress:
        found = diagnose(spacecraft, samples, load_settings(args.settings), effects=names,
                         pairs=not args.no_pairs, present=present, progress=progress)
    print(text(found))
    if args.json:
        args.json.write_text(json.dumps(found.to_json(), indent=1) + '\n')
    if args.html or args.markdown:
        from ssi_ros.report.diagnosis_page import view_of
        write_pages(found, args, view_of(found, spacecraft, samples,
                                         load_settings(args.settings), present))
    if args.apply:
        best = found.candidates[0]
        if not best.built:
            raise ValueError(f'{found.outcome}: there is no effect to write to {args.apply}')
        save_configuration(spacecraft, present + best.built, args.apply)
        print(f'wrote {args.apply}')
    return 0 if found.outcome in ('WITHIN_FLOOR', 'EXPLAINED', 'TIED') else 1


def run_against_reference(args):
    """Diagnose one bag against another of the same structure, whatever its channels are."""
    import json

    from ssi_ros.bag import parse_channel
    from ssi_ros.cli._options import Progress
    from ssi_ros.cli._samples import read_samples
    from ssi_ros.gap.reference import diagnose_reference
    from ssi_ros.gap.settings import load_settings

    for value, word in ((args.model, '--model'), (args.apply, '--apply')):
        if value is not None:
            raise ValueError(f'{word} needs a simulator, which a reference recording is not; '
                             f'leave out {word} or --reference')
    names = [n.strip() for n in args.effects.split(',')] if args.effects else None
    channels = [parse_channel(c) for c in args.channel] if args.channel else None
    reference, record = (read_samples(b, 0.0, channels) for b in (args.reference, args.bag))
    with Progress('diagnosing') as progress:
        found = diagnose_reference(reference, record, load_settings(args.settings),
                                   effects=names, pairs=not args.no_pairs, progress=progress)
    print(text(found))
    if args.json:
        args.json.write_text(json.dumps(found.to_json(), indent=1) + '\n')
    write_pages(found, args)
    return 0 if found.outcome in ('WITHIN_FLOOR', 'EXPLAINED', 'TIED') else 1


def write_pages(found, args, view=None):
    """Write the HTML page and the Markdown that were asked for; see `report.diagnosis_page`."""
    from ssi_ros.report.diagnosis_page import diagnosis_markdown, diagnosis_page

    reference = getattr(args, 'reference', None)
    words = {'bag': str(args.bag), 'nominal': f'--reference {reference}' if reference else
             f'--model {args.model or "config/spacecraft.yaml"}'}
    for path, make in ((args.html, diagnosis_page), (args.markdown, diagnosis_markdown)):
        if path:
            path.write_text(make(found, view, **words), encoding='utf-8')
            print(f'wrote {path}')


def text(found):
    """Return the diagnosis as lines in the order of an engineer's questions."""
    gap = found.gap
    lines = [f'{found.outcome}: {found.reason}',
             f'gap {gap["before"]:.4f} nats a band, floor {gap["floor"]:.4f} +- '
             f'{gap["floor_std"]:.4f}, p = {gap["p_value"]:.2g}']
    lines += [f'sign: {s}' for s in found.signs]
    where = found.where
    for kind, label in (('sensors', 'name'), ('modes', 'name')):
        if where[kind] and found.outcome != 'WITHIN_FLOOR':
            best = sorted(where[kind], key=lambda e: -e['share'])[:4]
            lines.append(f'{kind}: ' + ', '.join(
                (f'{e["frequency_hz"]:.3f} Hz ' if 'frequency_hz' in e else '')
                + f'{e[label]} {100 * e["share"]:.0f} %' for e in best))
    if found.outcome != 'WITHIN_FLOOR':
        lines.append('site: ' + ', '.join(f'{k} {100 * v:.0f} %'
                                          for k, v in where['site'].items() if v > 0.005))
    quiet = found.outcome == 'WITHIN_FLOOR'
    for c in found.candidates[:3] if quiet else found.candidates:
        if c.effects == ('none',) and c.probability < 0.001:
            continue
        closed = '' if c.closed != c.closed else (
            f', closes {100 * c.closed:.0f} % ({100 * c.closed_low90:.0f} to '
            f'{100 * c.closed_high90:.0f})')
        lines.append(f'  {" + ".join(c.effects)}: probability {c.probability:.3f}{closed}')
        places = [f'{k}={getattr(e, k)}' for e in c.built for k in ('channel', 'array', 'source')
                  if isinstance(getattr(e, k, None), str)]
        numbers = [f'{k.split(".")[-1]} = {v.value:.5g} +- {v.std:.2g} {v.unit}'.rstrip(' 1')
                   for k, v in c.parameters.items()]
        if places or numbers:
            lines.append('      ' + ', '.join(places + numbers))
    if found.separate_by:
        lines.append('would part them: ' + '; '.join(found.separate_by))
    return '\n'.join(lines)
