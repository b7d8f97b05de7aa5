"""
Find the verbs, parse the words, run the verb.

A verb is one file beside this one with HELP (a line), EXAMPLE (a command that works),
`add_arguments(parser)` and `run(args) -> exit code`. Heavy imports belong inside `run`, so that
`--help` answers at once.
"""
import argparse
import importlib
import os
import pkgutil
import sys

from ssi_ros import __version__, cli
from ssi_ros.cli._memory import keep_freed_memory

ROS = ('rclpy', '_msgs', '_srvs', '_interfaces')       # ends of names of its packages


def verbs():
    """Return the verb modules by name, in alphabetical order."""
    names = sorted(m.name for m in pkgutil.iter_modules(cli.__path__))
    modules = {n.rstrip('_'): importlib.import_module(f'ssi_ros.cli.{n}')
               for n in names if n != 'main' and not n.startswith('_')}
    return modules


def parser(wanted=None):
    """Return the parser of the whole command line, or of one verb beside the names of all."""
    top = argparse.ArgumentParser(
        prog='ssi_ros', description='Watch a flexible spacecraft on orbit: simulate, identify, '
        'log to MCAP, replay, diagnose.',
        epilog='ssi_ros VERB --help shows the options of a verb, with an example.')
    top.add_argument('--version', action='version', version=f'ssi_ros {__version__}')
    sub = top.add_subparsers(dest='verb', metavar='VERB', required=True)
    for name, module in verbs().items():
        verb = sub.add_parser(
            name, help=module.HELP, description=module.__doc__,
            epilog=f'example:\n  {module.EXAMPLE}',
            formatter_class=argparse.RawDescriptionHelpFormatter)
        if wanted in (None, name):
            module.add_arguments(verb)
        verb.set_defaults(run=module.run)
    return top


def main(argv=None):
    """Run one verb; return its exit code: 0 done, 1 a negative answer, 2 it cannot be done."""
    argv = sys.argv[1:] if argv is None else list(argv)
    # the options of other verbs need not be known, nor what they import
    args = parser(argv[0] if argv else '').parse_args(argv)
    keep_freed_memory()
    try:
        return args.run(args) or 0
    except BrokenPipeError:         # an OSError, so it goes first: the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, OSError) as error:
        words = error
        if getattr(error, 'filename', None) and error.strerror:
            words = f'{error.filename}: {error.strerror}'
        print(f'ssi_ros {args.verb}: {words}', file=sys.stderr)
        return 2
    except ModuleNotFoundError as error:
        if not (error.name or '').split('.')[0].endswith(ROS):
            raise
        print(f'ssi_ros {args.verb}: needs ROS 2, and {error.name} is not there; source '
              '/opt/ros/jazzy/setup.bash, or use the .venv that make sets up', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f'ssi_ros {args.verb}: stopped', file=sys.stderr)
        return 130
