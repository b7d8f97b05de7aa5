"""The command line's parser: an error is one sentence that says what is allowed."""
import argparse
import difflib
import re
import sys

from ssi_ros.cli._colour import painted
from ssi_ros.quantity import shown

# what argparse says, and how it is said here; values are quoted as they were typed
SAID = (
    (r'argument (\S+): invalid (?:int|integer) value: (.*)', r'\1 \2 is not a whole number'),
    (r'argument (\S+): invalid (?:float|number) value: (.*)', r'\1 \2 is not a number'),
    (r'argument (\S+): invalid choice: (.*?) \(choose from (.*)\)', r'\1 \2 is not one of \3'),
    (r'argument (\S+): expected one argument', r'\1 needs a value'),
    (r'argument (\S+): expected at least one argument', r'\1 needs at least one value'),
    (r'the following arguments are required: (.*)', r'\1 is missing'),
    (r'argument (\S+): (.*)', r'\1: \2'))


def near(word, known):
    """Return a question with the known word that is most like this one; empty where none is."""
    found = difflib.get_close_matches(word, known, 1)
    return f'; did you mean {found[0]}?' if found else ''


class Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are one line, for the verb that was typed."""

    def verb(self, name):
        """Return the parser of a verb, or this one where there is no such verb."""
        return next((a.choices[name] for a in self._actions
                     if isinstance(a, argparse._SubParsersAction) and name in a.choices), self)

    def parse_args(self, args=None, namespace=None):
        """Parse; what is left over is an error of the verb, not of the whole command."""
        found, rest = self.parse_known_args(args, namespace)
        if rest:
            self.verb(getattr(found, 'verb', None)).refuse(rest[0])
        return found

    def refuse(self, word):
        """Say of a word that it is no option of this verb, or more than it takes."""
        if word.startswith('-'):
            option = word.split('=')[0]
            self.error(f'there is no option {option}'
                       + near(option, list(self._option_string_actions)))
        takes = [str(a.metavar or a.dest) for a in self._actions if not a.option_strings]
        self.error(f'{word!r} is too much: '
                   + (f'give {" and ".join(takes)} only' if takes else 'options only'))

    def error(self, message):
        """Print one sentence and where more is said, and end with exit code 2."""
        choice = re.match(r"argument VERB: invalid choice: '(.*?)' ", message)
        if choice:
            verbs = list(next(a.choices for a in self._actions if a.dest == 'verb'))
            message = f'there is no verb {choice[1]!r}{near(choice[1], verbs)}'
        for pattern, words in SAID:
            if re.fullmatch(pattern, message, re.S):
                message = re.sub(pattern, words, message, flags=re.S)
                break
        more = ('' if message.endswith('?') else ';') + f' {self.prog} --help shows what it takes'
        print(painted(f'{self.prog}:', 'error', sys.stderr), shown(message) + more,
              file=sys.stderr)
        self.exit(2)
