"""What several verbs share: quantities as options, channels, progress."""
import sys

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
        parser.add_argument(flag, type=kind, default=default, metavar=kind.__name__.upper(),
                            help=f'{text} (default: {default})')


def read_quantities(args, cls, only=None):
    """Build the record from the options; ValueError names a value out of range."""
    return cls(**{f.name: getattr(args, f.name) for f in quantities(cls)
                  if only is None or f.name in only})


class Progress:
    """A progress bar on the terminal for anything over a moment: call it with the share done."""

    def __init__(self, text):
        self.text, self.bar = text, None

    def __call__(self, share):
        """Show the share done, 0 to 1."""
        if self.bar is None:
            from tqdm import tqdm
            # `delay` keeps quick work silent; a pipe gets no bar
            self.bar = tqdm(total=1.0, desc=self.text, delay=1.0, file=sys.stderr, leave=False,
                            bar_format='{desc} {percentage:3.0f}% |{bar}| {elapsed}<{remaining}',
                            disable=None)
        self.bar.update(share - self.bar.n)

    def say(self, line):
        """Print a line above the bar."""
        if self.bar is None:
            print(line, flush=True)
        else:
            self.bar.write(line)

    def __enter__(self):
        """Begin."""
        return self

    def __exit__(self, *error):
        """Take the bar away."""
        if self.bar is not None:
            self.bar.close()
