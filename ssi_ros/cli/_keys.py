"""A line on the terminal that shows where a bag is played, and keys that move it."""
import os
import select
import shutil
import sys
import termios
import threading
import tty

REFRESH_S = 0.2
STEPS_S = {b'\x1b[C': 10.0, b'\x1b[D': -10.0, b'\x1b[A': 60.0, b'\x1b[B': -60.0}
KEYS = 'space pauses, left/right 10 s, up/down 60 s, q ends'


def line(at_s, length_s, rate, plays, width):
    """
    Return the line for a place in a bag.

    Parameters
    ----------
    at_s, length_s : float
        Where it is and how long the bag is [s].
    rate : float
        Seconds of the bag a second.
    plays : bool
        Whether it plays; else it is paused.
    width : int
        Columns of the terminal; the line is shorter.

    """
    at_s = at_s % length_s if length_s > 0.0 and at_s > length_s else at_s
    words = f'{_clock(at_s)} / {_clock(length_s)}'
    state = f'x{rate:g} ' + ('playing' if plays else 'paused ')
    room = width - len(words) - len(state) - 6
    keys = f'  {KEYS}' if room >= len(KEYS) + 12 else ''
    cells = max(5, min(30, room - len(keys)))
    done = round(cells * min(1.0, at_s / length_s)) if length_s > 0.0 else cells
    return f'{words} [{"=" * done}{" " * (cells - done)}] {state}{keys}'[:max(1, width - 1)]


def _clock(seconds):
    minutes, seconds = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f'{hours}:{minutes:02d}:{seconds:02d}' if hours else f'{minutes}:{seconds:02d}'


class Keys:
    """
    Show where a player is and obey the keyboard, in a thread, until closed.

    Parameters
    ----------
    player : PlayerNode
        What is shown and moved.

    """

    def __init__(self, player):
        self.player, self._fd = player, sys.stdin.fileno()
        self._before = termios.tcgetattr(self._fd)
        tty.setcbreak(self._fd)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self):
        while not self._stop.is_set():
            ready, _, _ = select.select([self._fd], [], [], REFRESH_S)
            if ready:
                self._press(os.read(self._fd, 16))
            if hasattr(self.player, 'length_s'):        # configured
                self._show()

    def _press(self, key):
        if key == b' ':
            self.player.toggle()
        elif key in STEPS_S:
            self.player.seek(self.player.at_s + STEPS_S[key])
        elif key in (b'q', b'Q'):
            self.player.done.set()

    def _show(self):
        p = self.player
        text = line(p.at_s, p.length_s, p.rate, p.plays, shutil.get_terminal_size().columns)
        sys.stderr.write(f'\r\033[K{text}\r')           # a line of the log goes over it
        sys.stderr.flush()

    def close(self):
        """Give the terminal back."""
        self._stop.set()
        self._thread.join(timeout=2.0)
        termios.tcsetattr(self._fd, termios.TCSADRAIN, self._before)
        sys.stderr.write('\n')


def for_terminal():
    """Return `Keys` where a person sits at a terminal, None where input or output is a pipe."""
    return Keys if sys.stdin.isatty() and sys.stderr.isatty() else None
