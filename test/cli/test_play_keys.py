"""`ssi_ros play` at a terminal: the line, space, arrows and q, on a real pseudo-terminal."""
import os
import pty
import re
import select
import subprocess
import sys
import time

import numpy as np
import pytest
from ssi_ros.bag import write_samples
from ssi_ros.cli._keys import line
from ssi_ros.records import Samples


def test_the_line_fits_and_says_where_it_is():
    """Place, length, a bar, rate and state; the keys where there is room, never a second row."""
    text = line(42.4, 300.0, 10.0, True, 120)
    assert text.startswith('0:42 / 5:00 [====') and 'x10 playing' in text and 'space' in text
    assert 'paused' in line(42.4, 300.0, 1.0, False, 80)
    for width in (20, 40, 80, 200):
        assert len(line(4000.0, 8000.0, 1.0, True, width)) < width
    assert '1:06:40 / 2:13:20' in line(4000.0, 8000.0, 1.0, True, 80)


class Terminal:
    """The verb on a pseudo-terminal."""

    def __init__(self, *words):
        self.fd, end = pty.openpty()
        self.process = subprocess.Popen([sys.executable, '-m', 'ssi_ros', 'play', *words],
                                        stdin=end, stdout=end, stderr=end, close_fds=True)
        os.close(end)
        self.text = ''

    def read(self):
        """Read what has been printed."""
        while select.select([self.fd], [], [], 0.05)[0]:
            try:
                self.text += os.read(self.fd, 4096).decode(errors='replace')
            except OSError:          # the other end is closed
                return

    def wait(self, condition, patience_s=20.0):
        """Wait until the newest line fulfils a condition on (place [s], state)."""
        end = time.monotonic() + patience_s
        while True:
            self.read()
            shown = re.findall(r'(\d+):(\d\d) / \d+:\d\d \[.*?\] x\S+ (playing|paused)', self.text)
            if shown and condition(60 * int(shown[-1][0]) + int(shown[-1][1]), shown[-1][2]):
                return
            assert time.monotonic() < end, self.text[-500:]

    def press(self, key):
        """Press a key."""
        os.write(self.fd, key)


def test_keys_pause_seek_and_end(tmp_path):
    """Space pauses, arrows move by 10 s and a minute, space goes on, q ends with exit code 0."""
    pytest.importorskip('rclpy', reason='ROS 2 is not installed')
    write_samples(tmp_path / 'bag', Samples(np.zeros((20000, 1)), 100.0, ('a',), 10 ** 18))
    terminal = Terminal(str(tmp_path / 'bag'))
    try:
        terminal.wait(lambda at, state: state == 'playing' and at >= 1)
        terminal.press(b' ')
        terminal.wait(lambda at, state: state == 'paused')
        terminal.press(b'\x1b[A')
        terminal.wait(lambda at, state: state == 'paused' and 60 <= at <= 75)
        terminal.press(b'\x1b[C')
        terminal.wait(lambda at, state: 70 <= at <= 85)
        terminal.press(b'\x1b[D')
        terminal.wait(lambda at, state: 60 <= at <= 75)
        terminal.press(b' ')
        terminal.wait(lambda at, state: state == 'playing')
        terminal.press(b'\x1b[B')
        terminal.wait(lambda at, state: at < 30)
        terminal.press(b'q')
        end = time.monotonic() + 20.0
        while terminal.process.poll() is None and time.monotonic() < end:
            terminal.read()
        assert terminal.process.poll() == 0, terminal.text[-500:]
    finally:
        terminal.process.kill()
        os.close(terminal.fd)
