"""
Find the verbs, parse the words, run the verb.

A verb is one file beside this one with HELP (a line), EXAMPLE (a command that works),
`add_arguments(parser)` and `run(args) -> exit code`. Heavy imports belong inside `run`, so that
`--help` answers at once.
"""
import argparse
import contextlib
import importlib
import os
import pkgutil
import sys

from ssi_ros import __version__, cli
from ssi_ros.cli._colour import painted
from ssi_ros.cli._memory import keep_freed_memory
from ssi_ros.cli._options import name_values, QUIET
from ssi_ros.cli._outputs import check_outputs
from ssi_ros.cli._parser import Parser
from ssi_ros.quantity import shown

ROS = ('rclpy', '_msgs', '_srvs', '_interfaces')       # ends of names of its packages


def verbs():
    """Return the verb modules by name, in alphabetical order."""
    names = sorted(m.name for m in pkgutil.iter_modules(cli.__path__))
    modules = {n.rstrip('_'): importlib.import_module(f'ssi_ros.cli.{n}')
               for n in names if n != 'main' and not n.startswith('_')}
    return modules


def parser(wanted=None):
    """Return the parser of the whole command line, or of one verb beside the names of all."""
    top = Parser(
        prog='ssi_ros', description='Watch a flexible spacecraft on orbit: simulate, identify, '
        'log to MCAP, replay, diagnose.',
        epilog='ssi_ros help VERB shows the options of a verb, with an example.')
    top.add_argument('--version', action='version', version=f'ssi_ros {__version__}')
    sub = top.add_subparsers(dest='verb', metavar='VERB', required=True)
    for name, module in verbs().items():
        verb = sub.add_parser(
            name, help=module.HELP, description=module.__doc__,
            epilog=f'example:\n  {module.EXAMPLE}',
            formatter_class=argparse.RawDescriptionHelpFormatter)
        if wanted in (None, name):
            module.add_arguments(verb)
            name_values(verb)
        verb.add_argument('--quiet', action='store_true',
                          help='print errors only; files are written all the same')
        verb.set_defaults(run=module.run)
    return top


def _complete():
    """Answer a shell that completes a command, if argcomplete is there; this ends the process."""
    with contextlib.suppress(ImportError):
        import argcomplete
        argcomplete.autocomplete(parser())


def _complain(verb, words):
    # one line, whatever the names of a file hold
    print(painted(f'ssi_ros {verb}:', 'error', sys.stderr), shown(words), file=sys.stderr)


def main(argv=None):
    """Run one verb; return its exit code: 0 done, 1 a negative answer, 2 it cannot be done."""
    argv = sys.argv[1:] if argv is None else list(argv)
    if '_ARGCOMPLETE' in os.environ:         # a shell asks what could follow
        _complete()
    if argv[:1] == ['help']:
        argv = [*argv[1:2], '--help']
    if not argv:
        parser('').print_help(sys.stderr)
        return 2
    # the options of other verbs need not be known, nor what they import
    args = parser(argv[0] if argv else '').parse_args(argv)
    keep_freed_memory()
    try:
        check_outputs(args)
        if not args.quiet:
            return args.run(args) or 0
        os.environ[QUIET] = '1'
        with open(os.devnull, 'w') as nowhere, contextlib.redirect_stdout(nowhere):
            return args.run(args) or 0
    except BrokenPipeError:         # an OSError, so it goes first: the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, OSError) as error:
        words = error
        if getattr(error, 'filename', None) and error.strerror:
            words = f'{error.filename}: {error.strerror}'
            if isinstance(error, FileNotFoundError):
                words = f'{error.filename} does not exist; give a file that does'
        _complain(args.verb, words)
        return 2
    except ModuleNotFoundError as error:
        if not (error.name or '').split('.')[0].endswith(ROS):
            raise
        _complain(args.verb, f'needs ROS 2, and {error.name} is not there; source '
                  '/opt/ros/jazzy/setup.bash, or use the .venv that make sets up')
        return 2
    except KeyboardInterrupt:
        _complain(args.verb, 'stopped')
        return 130
    finally:
        os.environ.pop(QUIET, None)
