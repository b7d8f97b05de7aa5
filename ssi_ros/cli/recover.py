"""
Make a sound bag of one that a crash, a power loss or a full disk left behind.

The old bag is not changed.
"""
HELP = 'make a sound bag of one that was cut off'
EXAMPLE = 'ssi_ros recover night_1 --output night_1_recovered'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('bag', metavar='BAG', help='folder of the bag, or one .mcap')
    parser.add_argument('--output', metavar='FOLDER',
                        help='the new bag (default: BAG_recovered)')


def run(args):
    """Recover, say what was saved and lost; 1 when no message was saved."""
    from pathlib import Path

    from ssi_ros.bag import recover
    from ssi_ros.cli._options import Progress

    source = Path(args.bag)
    out = args.output or source.resolve().with_name(f'{source.resolve().stem}_recovered')
    with Progress('recovering') as progress:
        report = recover(source, out, progress)
    print(f'{sum(report.saved.values())} messages saved to {report.out}')
    for topic, count in report.saved.items():
        print(f'  {topic}: {count}')
    if report.last_ns is not None:
        print(f'from {report.first_ns} to {report.last_ns} ns, '
              f'{(report.last_ns - report.first_ns) / 1e9:.3f} s')
    for line in report.damage:
        print(f'damage: {line}')
    print(f'{report.bytes_dropped} of {report.bytes_read} bytes dropped; {report.salvaged} '
          'messages came out of a chunk that was cut')
    return 0 if any(report.saved.values()) else 1
