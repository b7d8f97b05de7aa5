"""
Check the set-up: ROS, middleware, disk, and what is on the graph now.

Every line is ok, warn or error, with what to do about it. Start the nodes that are to be checked
first: names, QoS of matching topics, clocks, rates and stamps are those of this moment. Exit code
0 without errors, 1 with one.
"""
HELP = 'check the set-up: ROS, middleware, QoS, clocks, names, rates, disk'
EXAMPLE = 'ssi_ros doctor --seconds 5'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--folder', default='.', metavar='FOLDER',
                        help='where bags are to be recorded (default: here)')
    parser.add_argument('--seconds', type=float, default=3.0, metavar='S',
                        help='how long samples are listened to [s] (default: 3)')
    parser.add_argument('--include-warnings', action='store_true',
                        help='exit code 1 also for a warning')
    parser.add_argument('--json', action='store_true', help='print the findings as JSON')


def run(args):
    """Check, print; 1 if something is wrong."""
    from dataclasses import asdict
    import json
    import shutil
    import sys

    from ssi_ros.cli._colour import painted
    from ssi_ros.quantity import things
    from ssi_ros.ros.doctor import machine
    from ssi_ros.ros.doctor_graph import graph

    findings = machine(args.folder) + graph(args.seconds)
    bad = [f for f in findings if f.level == 'error'
           or (f.level == 'warn' and args.include_warnings)]
    if args.json:
        print(json.dumps([asdict(f) for f in findings], indent=1))
        return 1 if bad else 0
    width = shutil.get_terminal_size().columns - 21 if sys.stdout.isatty() else 10 ** 6
    for f in findings:
        level = painted(f'{f.level:5s}', f.level, sys.stdout)
        for k, line in enumerate(wrapped(f.text, width)):
            print(f'{level} {f.what:14s} {line}' if not k else f'{"":21s}{line}')
        for k, line in enumerate(wrapped(f.fix, width - 3)):
            print(f'{"":21s}{"   " if k else "-> "}{line}')
    counts = {level: sum(f.level == level for f in findings) for level in ('warn', 'error')}
    print(f'{things(len(findings), "check")}: {things(counts["error"], "error")}, '
          f'{things(counts["warn"], "warning")}')
    return 1 if bad else 0


def wrapped(text, width):
    """Return a text in lines of at most so many characters; none of an empty one."""
    import textwrap
    return textwrap.wrap(text, max(width, 20), break_long_words=False, break_on_hyphens=False)
