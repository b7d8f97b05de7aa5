"""
Show live topics in Foxglove: a WebSocket on 127.0.0.1, the messages byte for byte.

The bridge node in this process. Open ws://127.0.0.1:8765 in Foxglove and import the layout
config/foxglove_layout.json. To look from another machine, forward the port:
ssh -L 8765:127.0.0.1:8765 HOST.
"""
HELP = 'show live topics in Foxglove'
EXAMPLE = 'ssi_ros bridge --port 8765'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('topics', nargs='*', metavar='TOPIC', default=['.*'],
                        help='regular expressions of topic names (default: all)')
    parser.add_argument('--port', type=int, default=8765,
                        help='port on 127.0.0.1, 0 for a free one (default: 8765)')


def run(args):
    """Run the bridge until it is stopped."""
    from ssi_ros.ros import bridge_node
    from ssi_ros.ros.node import ros_arguments
    return bridge_node.main(ros_arguments({'port': args.port, 'topics': args.topics}))
