"""
Make a sound bag of one that a crash, a power loss or a full disk left behind.

The old bag is not changed.
"""
HELP = 'make a sound bag of one that was cut off'
EXAMPLE = 'ssi_ros recover night_1 --output night_1_recovered'


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.limits import LIMITS, MIB
    parser.add_argument('bag', metavar='BAG', help='folder of the bag, or one .mcap')
    parser.add_argument('--output', metavar='FOLDER',
                        help='the new bag (default: BAG_recovered)')
    parser.add_argument('--largest-chunk-mib', type=float, default=LIMITS.chunk_bytes / MIB,
                        metavar='MIB', help='largest chunk that is read, decompressed; the new '
                        f'bag has chunks of 1 MiB (default: {LIMITS.chunk_bytes // MIB})')


def run(args):
    """Recover, say what was saved and lost; 1 when no message was saved."""
    from pathlib import Path

    from ssi_ros.bag import recover
    from ssi_ros.cli._options import Progress
    from ssi_ros.quantity import shown

    source = Path(args.bag)
    out = args.output or source.resolve().with_name(f'{source.resolve().stem}_recovered')
    with Progress('recovering') as progress:
        report = recover(source, out, progress, _bytes(args.largest_chunk_mib))
    print(f'{sum(report.saved.values())} messages saved to {report.out}')
    for topic, count in report.saved.items():
        print(shown(f'  {topic}: {count}'))
    if report.last_ns is not None:
        print(f'from {report.first_ns} to {report.last_ns} ns, '
              f'{(report.last_ns - report.first_ns) / 1e9:.3f} s')
    for line in report.damage:
        print(shown(f'damage: {line}'))
    print(f'{report.bytes_dropped} of {report.bytes_read} bytes dropped; {report.salvaged} '
          'messages came out of a chunk that was cut')
    if report.unchecked:
        print(f'{report.unchecked} chunk(s) have no checksum: damage inside them cannot be '
              'noticed')
    return 0 if any(report.saved.values()) else 1


def _bytes(mib):
    """Return whole bytes of a number of MiB; ValueError for one that is none."""
    if not 1.0 <= mib <= 16384.0:
        raise ValueError(f'--largest-chunk-mib {mib:g}: 1 to 16384 MiB are possible')
    return round(mib * (1 << 20))
