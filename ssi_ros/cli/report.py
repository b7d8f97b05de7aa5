"""
Make one HTML page of a bag: histories, spectra, poles, shapes in space, tracks, the gap.

The page needs no network and no colour vision. With --model the record is compared with that
spacecraft, diagnosed, and its modes move on it.
"""
from pathlib import Path

from ssi_ros.whole_file import write_whole

HELP = 'one interactive page of a bag'
EXAMPLE = 'ssi_ros report night_1 --model config/spacecraft.yaml --output night_1.html'


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._options import add_scale
    add_scale(parser)
    parser.add_argument('bag', type=Path, metavar='BAG', help='folder of the bag, or its .mcap')
    parser.add_argument('--output', type=Path, metavar='FILE',
                        help='where to write the page (default: BAG.html beside the bag)')
    parser.add_argument('--model', metavar='FILE',
                        help='spacecraft YAML, or .npz or .mat of any structure, to compare the '
                        'record with (default: none)')
    parser.add_argument('--no-diagnosis', action='store_true',
                        help='with --model: draw its curves, do not search the cause of a gap')
    parser.add_argument('--channel', action='append', metavar='TOPIC[:FIELD]',
                        help='a numeric field to use, repeatable (default: accel.linear.z of '
                        'every AccelStamped topic)')
    parser.add_argument('--rate-hz', type=float, default=0.0,
                        help='sampling rate [Hz] (default: estimated from the stamps)')
    parser.add_argument('--window-s', type=float, default=0.0,
                        help='length of the sliding window [s] (default: half of the record)')
    parser.add_argument('--hop-s', type=float, default=0.0,
                        help='time between two windows [s] (default: 20 windows)')


def run(args):
    """Read, identify, diagnose, write."""
    from ssi_ros.bag import open_bag, parse_channel, read_channels
    from ssi_ros.cli._mixed import check_publishers
    from ssi_ros.cli._modes import scaled
    from ssi_ros.cli._options import Progress, warn
    from ssi_ros.effects import load_configuration
    from ssi_ros.gap.check import match
    from ssi_ros.report.bag_page import bag_page, windows_of
    from ssi_ros.report.samples import samples_of
    from ssi_ros.report.wording import headline

    output = args.output or args.bag.with_suffix('.html')
    spacecraft, present = load_configuration(args.model) if args.model else (None, ())
    bag = open_bag(args.bag)
    channels = [parse_channel(c) for c in args.channel] if args.channel else None
    with Progress('reading') as progress:
        recording = read_channels(bag, channels, progress)
    check_publishers(bag, recording)
    recording = scaled(recording, args.scale)
    samples = samples_of(recording, args.rate_hz or (spacecraft.rate_hz if spacecraft else 0.0),
                         lambda sentence: warn([sentence]))
    judged = None
    if spacecraft:
        judged = _judge(spacecraft, present, samples, args)
        samples = match(spacecraft, samples)[1]
    with Progress('identifying') as progress:
        progress(0.0)
        windows = windows_of(samples, args.window_s, args.hop_s)
    facts = [('topics', ', '.join(c.topic for c in recording.channels)),
             *((k, v) for k, v in bag.custom_data.items() if v)]
    with Progress('drawing'):
        text = bag_page(args.bag.name, samples, windows, facts=facts, judged=judged)
    write_whole(output, text)
    if judged is not None and judged.diagnosis is not None:
        print(f'{judged.diagnosis.outcome}: {headline(judged.diagnosis.to_json())}')
    print(f'wrote {output}: {len(windows[-1].modes)} modes in the last of {len(windows)} windows, '
          f'{len(text) / 1e6:.1f} MB')
    return 0


def _judge(spacecraft, present, samples, args):
    from ssi_ros.cli._options import Progress
    from ssi_ros.gap.driver import diagnose
    from ssi_ros.gap.nominal.model import ModelNominal
    from ssi_ros.gap.settings import DiagnosisSettings
    from ssi_ros.report.bag_page import Judged
    from ssi_ros.report.diagnosis_page import view_of
    from ssi_ros.report.gap_view import gap_view

    settings = DiagnosisSettings()
    if args.no_diagnosis:
        return Judged(spacecraft, None, gap_view(spacecraft, samples, settings=settings,
                                                 present=present), args.model)
    with Progress('diagnosing') as progress:
        found = diagnose(ModelNominal(spacecraft, present), samples, settings,
                         progress=progress)
    return Judged(spacecraft, found, view_of(found, spacecraft, samples, settings, present),
                  args.model)
