"""
Play a bag: its messages byte for byte, at any rate, with /clock.

The player node in this process. At a terminal a line shows where it is: space pauses, left and
right go 10 s back and on, up and down a minute on and back, q ends (in a loop, what follows from
there is repeated).
Elsewhere `ros2 service call /player/pause std_srvs/srv/Trigger` pauses it.
"""
HELP = 'play a bag, with /clock'
EXAMPLE = 'ssi_ros play night_1 --rate 10 --loop --remap /accelerometer/e1_a:=/a'


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._options import between
    parser.add_argument('bag', metavar='BAG', help='folder of the bag, or its .mcap')
    parser.add_argument('--topic', action='append', metavar='TOPIC',
                        help='regular expression of topic names, repeatable (default: all)')
    parser.add_argument('--rate', type=between(1e-3, 1e3), default=1.0,
                        help='seconds of the bag a second (default: 1)')
    parser.add_argument('--start-s', type=between(0, 1e9), default=0.0,
                        help='begin so far into the bag [s]')
    parser.add_argument('--duration-s', type=between(0, 1e9), default=0.0,
                        help='play so much of it [s] (default: to the end)')
    parser.add_argument('--loop', action='store_true',
                        help='begin anew at the end; stamps go on rising')
    parser.add_argument('--paused', action='store_true', help='begin paused')
    parser.add_argument('--reliable', action='store_true',
                        help='publish reliable, and wait for reliable readers that are behind')
    parser.add_argument('--wait-for-subscribers', type=between(0, 100, int), default=0,
                        metavar='N',
                        help='begin when every topic has so many subscribers (default: 0)')
    parser.add_argument('--no-clock', action='store_true', help='do not publish /clock')
    parser.add_argument('--remap', action='append', default=[], metavar='FROM:=TO',
                        help='play a topic under another name, repeatable')


def run(args):
    """Run the player until the end of the bag or until it is stopped."""
    for remap in args.remap:
        if ':=' not in remap:
            raise ValueError(f'--remap {remap} is not of the form FROM:=TO')
    from ssi_ros.cli._keys import for_terminal
    from ssi_ros.ros import player_node
    from ssi_ros.ros.node import ros_arguments
    return player_node.main(ros_arguments({
        'bag': args.bag, 'topics': args.topic or ['.*'], 'rate': args.rate,
        'start_s': args.start_s, 'duration_s': args.duration_s, 'loop': args.loop,
        'paused': args.paused, 'publish_clock': not args.no_clock, 'reliable': args.reliable,
        'wait_for_subscribers': args.wait_for_subscribers}, args.remap), beside=for_terminal())
