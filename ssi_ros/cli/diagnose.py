"""
Diagnose the gap between a simulator and a recording.

It says whether there is a gap, where it lies, which unmodelled effect causes it, of which size and
with which probability, and how much of the gap that effect removes on data that its fit did not
use. Exit code 0: the record is explained (or there is no gap), 1: it is not.
"""
from pathlib import Path

from ssi_ros.whole_file import write_whole

HELP = 'find which unmodelled effect makes a bag differ from the model'
EXAMPLE = 'ssi_ros diagnose quiet --json diagnosis.json'
OF_TEMPLATES, OF_SEGMENTS = 0.65, 20.0  # copies of l x l numbers in each bin, of 8 bytes


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._inputs import add_input
    from ssi_ros.cli._options import add_scale
    parser.add_argument('bag', type=Path, metavar='BAG', nargs='?', help='folder of the bag')
    parser.add_argument('--many', type=Path, metavar='FOLDER',
                        help='diagnose every bag below this folder on a Dask cluster; the same '
                        'command goes on where it was stopped; --json then names a folder')
    parser.add_argument('--workers', type=int, metavar='N',
                        help='with --many: processes on this machine (default: one a core)')
    parser.add_argument('--scheduler', metavar='tcp://...',
                        help='with --many: a running Dask scheduler in place of own processes; '
                        'whoever reaches one without TLS can run code as its user')
    parser.add_argument('--model', metavar='FILE',
                        help='spacecraft YAML of the simulator, or .npz or .mat of any structure '
                        '(default: the packaged spacecraft)')
    parser.add_argument('--reference', type=Path, metavar='BAG0',
                        help='a healthy bag of the same structure: alone it is the nominal; with '
                        '--model the model is calibrated on it first')
    parser.add_argument('--channel', action='append', metavar='TOPIC[:FIELD]',
                        help='with --reference, or a model in .npz or .mat: a numeric field of '
                        'the bag, in the order of the channels of a model; repeatable (default: '
                        'accel.linear.z of every AccelStamped topic)')
    add_input(parser)
    add_scale(parser)
    parser.add_argument('--settings', metavar='FILE', help='YAML as config/diagnosis.yaml')
    parser.add_argument('--effects', metavar='A,B', help='consider only these effects')
    parser.add_argument('--no-pairs', action='store_true',
                        help='do not search two effects at once')
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
    from ssi_ros.effects import save_configuration
    from ssi_ros.gap.driver import diagnose
    from ssi_ros.gap.settings import load_settings

    if (args.bag is None) == (args.many is None):
        raise ValueError('give one bag, or --many FOLDER')
    if args.many is not None:
        from ssi_ros.cli._many import run_many
        return run_many(args)
    if args.workers is not None or args.scheduler is not None:
        raise ValueError('--workers and --scheduler belong to --many')
    nominal, samples = _inputs(args)
    settings = load_settings(args.settings)
    names = [n.strip() for n in args.effects.split(',')] if args.effects else None
    _check_memory(nominal, samples, settings, names)
    with Progress('diagnosing') as progress:
        found = diagnose(nominal, samples, settings, effects=names, pairs=not args.no_pairs,
                         progress=progress)
    print(text(found))
    if args.json:
        write_whole(args.json, json.dumps(found.to_json(), indent=1) + '\n')
    if args.html or args.markdown:
        write_pages(found, args, _view(found, nominal, samples, settings),
                    _of_inputs(found, nominal, samples, settings))
    if args.apply:
        best = found.candidates[0]
        if not best.built:
            raise ValueError(f'{found.outcome}: there is no effect to write to {args.apply}')
        save_configuration(nominal.spacecraft, nominal.present + best.built, args.apply)
        print(f'wrote {args.apply}')
    return 0 if found.outcome in ('WITHIN_FLOOR', 'EXPLAINED', 'TIED') else 1


def _check_memory(nominal, samples, settings, names):
    """Raise ValueError where templates of many channels would need more memory than is free."""
    from ssi_ros.cli._memory import check_memory
    from ssi_ros.effects import applicable, effect_class
    from ssi_ros.gap.nominal.starting_points import starting_points
    from ssi_ros.gap.spectra.segmentation import frame_of, MOST

    spacecraft = getattr(nominal, 'spacecraft', None)
    if spacecraft is None:
        return
    try:
        frame = frame_of(samples, settings)
    except ValueError:      # too short: the diagnosis says so
        return
    starts = starting_points(
        [effect_class(n) for n in applicable(spacecraft, names)], spacecraft)
    channels = len(spacecraft.sensors)
    # measured with 4 and 16 channels, ten minutes to three hours
    copies = OF_TEMPLATES * len(starts) + OF_SEGMENTS * min(frame.segments, MOST)
    check_memory(8.0 * copies * (frame.last - frame.first) * channels ** 2,
                 f'a diagnosis with {len(starts)} starting values of effects on {channels} '
                 'channels (give --effects, or a model of fewer sensors)')


def _inputs(args):
    """Return the nominal, a model or a recording, and the samples of the bag."""
    from ssi_ros.bag import parse_channel
    from ssi_ros.cli._inputs import read_inputs
    from ssi_ros.cli._samples import read_samples
    from ssi_ros.effects import load_configuration
    from ssi_ros.gap.nominal.model import ModelNominal
    from ssi_ros.gap.nominal.recorded import RecordedNominal

    if args.reference is None or args.model is not None:
        spacecraft, present = load_configuration(args.model)
        channels = channels_of(spacecraft, args.channel)
        if args.reference is not None:
            spacecraft = _calibrated(spacecraft, present, channels, args)
        samples = read_samples(args.bag, spacecraft.rate_hz, channels, args.scale,
                               staggered=not args.input)
        inputs = read_inputs(args.bag, args.input, spacecraft, samples)
        return ModelNominal(spacecraft, present, inputs), samples
    if args.input:
        raise ValueError('--input is predicted by a model; give --model as well, or leave it out')
    if args.apply is not None:
        raise ValueError('--apply needs a simulator, which a reference recording is not; give '
                         '--model as well, or leave out --apply')
    channels = [parse_channel(c) for c in args.channel] if args.channel else None
    reference, record = (read_samples(b, 0.0, channels, args.scale)
                         for b in (args.reference, args.bag))
    return RecordedNominal(reference), record


def _calibrated(spacecraft, present, channels, args):
    """Return the model moved onto the healthy recording."""
    from ssi_ros.cli._inputs import inputs_of_each
    from ssi_ros.cli._options import Progress
    from ssi_ros.cli._samples import read_samples
    from ssi_ros.gap.settings import load_settings
    from ssi_ros.updating.calibrate import calibrate

    healthy = read_samples(args.reference, spacecraft.rate_hz, channels, args.scale,
                           staggered=not args.input)
    inputs = inputs_of_each([args.reference], args.input, spacecraft, [healthy])
    with Progress('calibrating') as progress:
        found = calibrate(spacecraft, [healthy], load_settings(args.settings),
                          names=[args.reference.name], present=present, inputs=inputs,
                          progress=progress)
    return found.spacecraft


def channels_of(model, given):
    """Return the channels of a bag that a model's channels are read from, None for their names."""
    from dataclasses import replace

    from ssi_ros.bag import parse_channel

    if not given:
        return None
    names = [s.name for s in model.sensors]
    if model.arrays:
        raise ValueError('--channel belongs to --reference; a model names its own channels')
    if len(given) != len(names):
        raise ValueError(f'--channel is given {len(given)} times, but the model has the channels '
                         f'{", ".join(names)}; give one for each, in this order')
    return [replace(parse_channel(c), name=n) for c, n in zip(given, names)]


def _view(found, nominal, samples, settings):
    """Return the curves of a page: record beside nominal, before and after."""
    from ssi_ros.gap.nominal.pairing import make_pair
    from ssi_ros.records import Samples
    from ssi_ros.report.diagnosis_page import view_of
    from ssi_ros.report.gap_view import reference_view

    if hasattr(nominal, 'spacecraft'):
        return view_of(found, nominal.spacecraft, samples, settings, nominal.present)
    pair = make_pair(nominal.reference, samples)
    both = (Samples(v, pair.rate_hz, pair.channels) for v in (pair.reference, pair.record))
    return reference_view(*both, settings)


def _of_inputs(found, nominal, samples, settings):
    """Return the sections of a page on recorded inputs."""
    from ssi_ros.report.input_section import input_section

    if getattr(nominal, 'inputs', None) is None or found.outcome == 'TOO_LITTLE_DATA':
        return ()
    return (input_section(nominal, samples, settings),)


def write_pages(found, args, view, more=()):
    """Write the HTML page and the Markdown that were asked for; see `report.diagnosis_page`."""
    from ssi_ros.report.diagnosis_page import diagnosis_markdown, diagnosis_page

    words = {'bag': str(args.bag), 'nominal': ' '.join(filter(None, (
        f'--model {args.model or "config/spacecraft.yaml"}'
        if args.model or not args.reference else '',
        f'--reference {args.reference}' if args.reference else '',
        *(f'--input {text}' for text in args.input or ()))))}
    for path, make in ((args.html, diagnosis_page), (args.markdown, diagnosis_markdown)):
        if path:
            write_whole(path, make(found, view, more=more, **words))
            print(f'wrote {path}')


def text(found):
    """Return the diagnosis as lines in the order of an engineer's questions."""
    from ssi_ros.quantity import p_value_text
    from ssi_ros.report.wording import headline

    found = found.to_json()
    gap, outcome = found['gap'], found['outcome']
    lines = [f'{outcome}: {headline(found)}']
    if found['reason'] not in lines[0]:
        lines.append(found['reason'])
    lines.append(f'missing: {found["missing"]["text"]}')
    lines += [f'detected: {s}' for s in found['signs']]
    if outcome == 'TOO_LITTLE_DATA':
        return '\n'.join(lines)
    lines.append(f'gap {gap["before"]:.4f} nats a band, floor {gap["floor"]:.4f} +- '
                 f'{gap["floor_std"]:.4f}, p-value {p_value_text(gap["p_value"])}')
    quiet = outcome == 'WITHIN_FLOOR'
    if not quiet:
        lines += _where_lines(found['where'])
    for c in found['candidates'][:3] if quiet else found['candidates']:
        if c['effects'] != ['none'] or c['probability'] >= 0.005:
            lines += _candidate_lines(c, found['verdict'].get('hidden', 0.0))
    if found['separate_by']:
        lines.append('what would distinguish them: ' + '; '.join(found['separate_by']))
    return '\n'.join(lines)


def _where_lines(where):
    """Return the sensors, modes and sites with the largest shares of the gap."""
    from ssi_ros.report.parts import percent
    lines = []
    for kind in ('sensors', 'modes'):
        best = sorted((e for e in where[kind] if e['share'] > 0.005), key=lambda e: -e['share'])
        if best:
            lines.append(f'{kind}: ' + ', '.join(
                (f'{e["frequency_hz"]:.3f} Hz ' if 'frequency_hz' in e else '')
                + f'{e["name"]} {100 * e["share"]:.0f} %' for e in best[:4]))
    sites = ', '.join(f'{k} {percent(v)}' for k, v in where['site'].items() if v > 0.005)
    return lines + ([f'site: {sites}'] if sites else [])


def _candidate_lines(candidate, hidden):
    """Return a candidate's probability, what it removes of the gap, and its quantities."""
    from ssi_ros.quantity import probability_text
    from ssi_ros.report.wording import compact, interval, quantities, removed

    known = candidate['effects'][0] not in ('unknown', 'none')
    share = known and removed(candidate)
    lines = [f'  {" + ".join(candidate["effects"])}: probability '
             f'{probability_text(candidate["probability"])}'
             + (f', {share}, 90 % interval {interval(candidate)}' if share else '')]
    if candidate['effects'] == ['unknown'] and hidden >= 0.005:
        lines[0] += f', {probability_text(hidden)} of it for one more effect, too small to be seen'
    for effect in dict.fromkeys(candidate['effects']) if known else ():
        places, numbers = quantities(candidate, effect)
        said = places + [f'{name} {size}' for name, size in compact(numbers)]
        if said:
            lines.append('      ' + ', '.join(said))
    return lines
