"""Write stamps and values of a bag's channels to an NPZ, CSV or universal file (UFF-58)."""
HELP = "write a bag's channels to NPZ, CSV or a universal file"
EXAMPLE = 'ssi_ros export night_1 --output night_1.csv --channel /imu:linear_acceleration.z'


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._options import add_scale
    add_scale(parser)
    parser.add_argument('bag', metavar='BAG', help='folder of the bag, or its .mcap or .db3')
    parser.add_argument('--output', required=True, metavar='FILE',
                        help='FILE.npz, FILE.csv, or FILE.uff or .unv (needs pyuff)')
    parser.add_argument('--channel', action='append', metavar='TOPIC:FIELD',
                        help='what to write, repeatable (default: the accelerometers)')


def run(args):
    """Read the channels and write the file."""
    from ssi_ros.bag import open_bag, parse_channel, read_channels
    from ssi_ros.bag.export import check_export, export_recording
    from ssi_ros.cli._modes import scaled
    from ssi_ros.cli._options import Progress, warn
    from ssi_ros.quantity import shown

    check_export(args.output)
    channels = [parse_channel(c) for c in args.channel] if args.channel else None
    with Progress('reading') as progress:
        bag = open_bag(args.bag)
        warn(bag.warnings)
        recording = read_channels(bag, channels, progress)
    recording = scaled(recording, args.scale)
    export_recording(recording, args.output)
    for name, values, by_log in zip(recording.names, recording.values, recording.by_log_time):
        print(shown(f'{name}: {len(values)} samples')
              + (', stamped by log time: there is no header stamp' if by_log else ''))
