"""
Record topics to an MCAP bag that survives a crash: flushed and synced every half second.

The recorder node in this process. Ctrl-C closes the bag.
"""
HELP = 'record topics to an MCAP bag'
EXAMPLE = "ssi_ros record '/accelerometer/.*' --output night_1"


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('topics', nargs='*', metavar='TOPIC', default=['.*'],
                        help='regular expressions of topic names (default: all)')
    parser.add_argument('--output', default='', metavar='BAG',
                        help='folder of the new bag (default: recording_<date>_<time>)')
    parser.add_argument('--compression', default='zstd', choices=('zstd', 'lz4', 'none'))
    parser.add_argument('--split-bytes', type=int, default=0,
                        help='begin a new file at this size [B] (default: never)')
    parser.add_argument('--split-s', type=float, default=0.0,
                        help='begin a new file after this time [s] (default: never)')
    parser.add_argument('--use-sim-time', action='store_true', help='stamp by /clock')


def run(args):
    """Run the recorder until it is stopped."""
    from ssi_ros.ros import recorder_node
    from ssi_ros.ros.node import ros_arguments
    return recorder_node.main(ros_arguments({
        'bag': args.output, 'topics': args.topics, 'compression': args.compression,
        'split_bytes': args.split_bytes, 'split_s': args.split_s,
        'use_sim_time': args.use_sim_time}))
