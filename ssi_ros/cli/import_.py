"""
Make a bag of accelerometer topics of a CSV, NPZ or MAT file.

An empty cell or NaN is a missing sample and gets no message. Samples are m/s^2 after --scale.
"""
HELP = 'make a bag of a CSV, NPZ or MAT file'
EXAMPLE = 'ssi_ros import test.csv --rate-hz 100 --output test_bag --columns ax,ay'


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._options import between
    from ssi_ros.cli._outputs import add_overwrite
    add_overwrite(parser)
    parser.add_argument('file', metavar='FILE', help='.csv with a header, .npz, or .mat (v5, v7)')
    parser.add_argument('--output', required=True, metavar='BAG', help='folder of the new bag')
    parser.add_argument('--rate-hz', type=between(1e-6, 1e6), help='sampling rate [Hz]')
    parser.add_argument('--time-column', metavar='NAME',
                        help='column of times [s], or [ns] if its name ends in _ns')
    parser.add_argument('--columns', metavar='A,B', help='columns, or one-dimensional variables')
    parser.add_argument('--variable', metavar='NAME', help='variable (samples, channels)')
    parser.add_argument('--names', metavar='A,B', help='names of the channels')
    parser.add_argument('--transpose', action='store_true',
                        help='the variable has one channel a row')
    parser.add_argument('--scale', type=between(-1e12, 1e12), default=1.0,
                        help='factor to m/s^2, 9.80665 for g (default: 1)')
    parser.add_argument('--start-s', type=between(0, 2 ** 31 - 1), default=1.0, metavar='S',
                        help='stamp of the first row [s since 1970] without a time column '
                        '(default: 1; viewers refuse a stamp of 0)')


def run(args):
    """Read the file and write the bag."""
    import numpy as np

    from ssi_ros.bag import write_samples
    from ssi_ros.bag.table import load_table
    from ssi_ros.cli._options import Progress
    from ssi_ros.cli._outputs import check_room, make_room

    check_room(args.output, args.overwrite)
    samples = load_table(
        args.file, rate_hz=args.rate_hz, columns=args.columns and args.columns.split(','),
        variable=args.variable, time_column=args.time_column,
        names=args.names and args.names.split(','), transpose=args.transpose, scale=args.scale,
        start_s=args.start_s)
    make_room(args.output)
    with Progress('writing') as progress:
        write_samples(args.output, samples, extra={'imported_from': args.file},
                      progress=progress)
    print(f'{samples.values.shape[0]} rows of {", ".join(samples.channels)} at '
          f'{samples.rate_hz:g} Hz, {samples.duration_s:g} s, in {args.output}')
    missing = int(np.isnan(samples.values).sum())
    if missing:
        print(f'{missing} samples are missing (empty or NaN) and have no message')
