"""
Watch live or replayed results in the terminal: modes with trends, health, the gap.

It listens to the identifier's modes, to /diagnostics, and to the gap node if one runs; it works
over ssh. Keys: q quits, p holds the screen. With --plain it prints lines, for a log or a pipe.
"""
HELP = 'watch modes, health and gap in the terminal'
EXAMPLE = 'ssi_ros monitor --identifier /identifier --gap /gap'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--identifier', default='/identifier', metavar='NODE',
                        help='name of the identifier node (default: /identifier)')
    parser.add_argument('--gap', default='/gap', metavar='NODE',
                        help='name of the gap node (default: /gap)')
    parser.add_argument('--plain', action='store_true', help='print each window as lines')
    parser.add_argument('--windows', type=int, default=0, metavar='N',
                        help='end after so many windows (default: go on); with --plain')


def run(args):
    """Listen and show until stopped."""
    import sys
    if args.windows < 0:
        raise ValueError(f'windows={args.windows} must be 0, to go on, or more')
    if not args.plain and not sys.stdout.isatty():
        raise ValueError('the output is no terminal; give --plain to print lines')
    screen = None if args.plain else _screen()
    from ssi_ros.ros.listener import Listener
    listener = Listener(args.identifier, args.gap)
    try:
        if args.plain:
            _print(listener, args.windows)
        else:
            screen(lambda: listener.watch).run()
    finally:
        listener.close()
    return 0


def _screen():
    try:
        from ssi_ros.monitor.screen import Screen
    except ImportError:
        raise ValueError('the screen needs a Textual of 2023 or later: pip install textual; '
                         'or give --plain') from None
    return Screen


def _print(listener, count):
    import time

    from ssi_ros.monitor.words import text
    last, shown = None, 0
    while not count or shown < count:
        watch = listener.watch
        if watch.windows and watch.windows[-1] is not last:
            last, shown = watch.windows[-1], shown + 1
            print(text(watch, time.monotonic()) + '\n', flush=True)
        time.sleep(0.1)
