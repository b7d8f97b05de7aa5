"""What several verbs share: quantities as options, names of their values, progress."""
import argparse
import os
import sys
import threading

from ssi_ros.quantity import quantities


def add_quantities(parser, cls, only=None):
    """Add an option for each quantity of a record class, with its unit and range in the help."""
    for f in quantities(cls):
        if only is not None and f.name not in only:
            continue
        meta, default = f.metadata, f.default
        unit = '' if meta['unit'] == '1' else f' [{meta["unit"]}]'
        text = f'{meta["doc"]}{unit}'.replace('%', '%%')
        flag = '--' + f.name.replace('_', '-')
        if isinstance(default, bool):
            parser.add_argument(flag, action='store_true', default=default, help=text)
            continue
        kind = (int if isinstance(default, int) else
                float if isinstance(default, float) else str)
        parser.add_argument(flag, type=kind, default=default,
                            help=f'{text} (default: {default})')


def add_scale(parser):
    """Declare the option of verbs that read the samples of a bag."""
    parser.add_argument('--scale', type=float, default=1.0,
                        help='factor from the unit of the bag to m/s^2: 9.80665 for bags in g '
                        '(default: 1)')


UNITS = {'_s': 'S', '_hz': 'HZ', '_bytes': 'BYTES'}       # ends of names of options


def name_values(parser):
    """Give every option's value its name in the help: its unit, N for a count, X for a factor."""
    for action in parser._actions:
        if not action.option_strings or action.metavar or action.choices or action.nargs == 0:
            continue
        unit = next((u for end, u in UNITS.items() if action.dest.endswith(end)), None)
        kinds = {int: 'N', float: 'X', str: 'NAME'}
        kind = getattr(action.type, 'kind', action.type)
        action.metavar = unit or kinds.get(kind, action.dest.upper())


def read_quantities(args, cls, only=None):
    """Build the record from the options; ValueError names a value out of range."""
    return cls(**{f.name: getattr(args, f.name) for f in quantities(cls)
                  if only is None or f.name in only})


QUIET = 'SSI_ROS_QUIET'        # set where nothing but errors is to be printed


def warn(sentences):
    """Print warnings, one a line, beside what the verb prints and above a bar that is there."""
    for sentence in sentences:
        from tqdm import tqdm
        tqdm.write(f'warning: {sentence}', file=sys.stderr)


def say_taken(path):
    """Say which numbers a spacecraft's YAML leaves out, so that the packaged ones are taken."""
    from ssi_ros.effects.config import taken_values
    names = taken_values(path)
    if names:
        warn([f'{path} does not give {", ".join(names[:20])}'
              + (f' and {len(names) - 20} more' if len(names) > 20 else '')
              + '; the packaged values are taken'])


def typed(args, add_arguments, leave_out=()):
    """
    Return the words of a command line: every argument that is not at its default.

    Parameters
    ----------
    args : argparse.Namespace
        What the command line gave.
    add_arguments : callable
        Of the verb, which declares its options.
    leave_out : sequence of str
        Names of options that are not wanted.

    Returns
    -------
    list of str

    """
    parser = argparse.ArgumentParser(add_help=False)
    add_arguments(parser)
    words = []
    for action in parser._actions:
        value = getattr(args, action.dest)
        if value == action.default or action.dest in leave_out:
            continue
        if not action.option_strings:
            words.append(str(value))
        elif action.nargs == 0:
            words.append(action.option_strings[-1])
        else:
            for one in value if isinstance(value, list) else [value]:
                one = f'{one:.15g}' if isinstance(one, float) else str(one)
                # in one word, so that a value may begin with a minus
                words += ([f'{action.option_strings[-1]}={one}'] if one.startswith('-') else
                          [action.option_strings[-1], one])
    return words


def between(low, high, kind=float):
    """Return the type of an option that is a finite number within a range."""
    def number(text):
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f'{text!r:.40} given; a number from {low:g} to {high:g} is needed')
        return value
    number.kind = kind
    return number


class Progress:
    """
    A progress bar on the terminal for anything over a moment: call it with the share done.

    It is there after `DELAY_S` and its clock runs, also while a long step reports nothing.
    """

    DELAY_S, TICK_S = 0.8, 0.5      # quick work stays silent

    def __init__(self, text):
        self.text, self.bar, self._end = text, None, threading.Event()
        self._thread = threading.Thread(target=self._tick, daemon=True)

    def __call__(self, share):
        """Show the share done, 0 to 1."""
        self.bar.update(share - self.bar.n)

    def say(self, line):
        """Print a line above the bar."""
        self.bar.write(line)
        sys.stdout.flush()

    def _tick(self):
        pause_s = self.DELAY_S
        while not self._end.wait(pause_s):
            self.bar.update(0)
            pause_s = self.TICK_S

    def __enter__(self):
        """Begin."""
        from tqdm import tqdm
        # a pipe gets no bar
        self.bar = tqdm(total=1.0, desc=self.text, delay=self.DELAY_S, miniters=0,
                        file=sys.stderr, leave=False,
                        bar_format='{desc} {percentage:3.0f}% |{bar}| {elapsed}<{remaining}',
                        disable=True if os.environ.get(QUIET) else None)
        if not self.bar.disable:
            self._thread.start()
        return self

    def __exit__(self, *error):
        """Take the bar away."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()
        self.bar.close()
