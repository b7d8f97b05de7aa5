"""The screen by Textual's pilot, and the monitor beside real nodes."""
import asyncio
import subprocess
import sys
import time

import pytest

from ssi_ros.cli.main import main
from ssi_ros.monitor.watch import Status, Watch, with_health, with_window
from ssi_ros.records import Mode, WindowModes

pytest.importorskip('textual', reason='Textual is not installed')


class Board:
    """A watch that a test changes."""

    def __init__(self):
        self.watch = Watch()

    def hear(self, end_s, frequency_hz):
        """Let one window come."""
        mode = Mode(frequency_hz, 0.005, [1.0], 0.01, 0.001, identity=3, label='structural')
        window = WindowModes(0, round(end_s * 1e9), (mode,))
        self.watch = with_window(self.watch, window, time.monotonic())


def on_screen(size, act):
    """Run the screen at a size; `act(app, pilot, board)` is awaited."""
    from ssi_ros.monitor.screen import Screen
    board = Board()

    async def run():
        app = Screen(lambda: board.watch)
        async with app.run_test(size=size) as pilot:
            await act(app, pilot, board)
    asyncio.run(run())


def words(app, name):
    """Return what a panel shows."""
    return str(app.query_one(f'#{name}').content)


@pytest.mark.parametrize('size', [(160, 48), (80, 24)])
def test_screen_follows_the_watch(size):
    """A new window shows within the period; p holds the screen, p again lets it go on."""
    async def act(app, pilot, board):
        assert 'nothing heard' in words(app, 'head')
        board.hear(10, 1.25)
        board.watch = with_health(board.watch, [Status('node', 'error', 'lost')],
                                  time.monotonic())
        app.look()
        await pilot.pause()
        assert '1.250' in words(app, 'modes') and 'ERROR' in words(app, 'health')
        assert '●' in words(app, 'sketch') and 'no gap node' in words(app, 'gap')
        # the panel is in the visible part of a small terminal too
        region = app.query_one('#modes').region
        assert region.height > 0 and region.right <= max(size[0], 88)
        await pilot.press('p')
        board.hear(11, 1.75)
        app.look()
        assert 'PAUSED' in words(app, 'head') and '1.250' in words(app, 'modes')
        await pilot.press('p')
        assert '1.750' in words(app, 'modes')
        await pilot.press('q')
        assert app._exit
    on_screen(size, act)


def test_a_small_terminal_shows_the_modes_first():
    """At 80 x 24 twenty modes are in sight with one line of health; d shows gap and health."""
    async def act(app, pilot, board):
        modes = tuple(Mode(0.5 * (i + 1), 0.005, [1.0], 0.001, 0.001, identity=i,
                           label='structural') for i in range(20))
        board.watch = with_window(board.watch, WindowModes(0, 10 ** 10, modes), time.monotonic())
        board.watch = with_health(board.watch, [Status('node', 'error', 'lost')],
                                  time.monotonic())
        app.look()
        await pilot.pause()
        box = app.query_one('#modes_box')
        assert box.region.y <= 1 and box.region.height >= 21       # the head and twenty modes
        assert max(map(len, words(app, 'modes').splitlines())) <= 80
        assert 'ERROR node: lost' in words(app, 'summary')
        assert app.query_one('#summary').region.height == 1
        assert not app.query_one('#sketch').display and not app.query_one('#side').display
        await pilot.press('d')
        await pilot.pause()
        assert app.query_one('#side').display and not app.query_one('#modes_box').display
    on_screen((80, 24), act)


def test_only_changes_are_drawn():
    """A watch that stands still costs nothing: no panel but the head is written again."""
    async def act(app, pilot, board):
        board.hear(10, 1.25)
        app.look()
        before, calls = dict(app.shown), []
        panel = app.query_one('#modes')
        panel.update = calls.append
        for _ in range(3):
            app.look()
        assert not calls and app.shown['modes'] == before['modes']
    on_screen((160, 48), act)


def test_wants_a_terminal(capsys):
    """Without a terminal the screen is refused with the way out."""
    assert main(['monitor']) == 2
    assert '--plain' in capsys.readouterr().err


def test_real_nodes(tmp_path):
    """Simulator and identifier in their own processes: the monitor prints their modes."""
    pytest.importorskip('rclpy', reason='ROS 2 is not installed')
    from ssi_ros.ros.demo import Processes
    nodes = Processes(tmp_path / 'log')
    command = [sys.executable, '-m', 'ssi_ros', 'monitor', '--plain', '--windows', '2']
    monitor = subprocess.Popen(command, env=nodes.environment, stdout=subprocess.PIPE, text=True)
    try:
        nodes.start('identifier', 'identifier', window_s=10.0, hop_s=2.0, reliable=True,
                    expected_rate_hz=400.0)
        nodes.start('simulator', 'simulator', speed=4.0, duration_s=40.0, reliable=True,
                    wait_for_subscribers=1)
        out, _ = monitor.communicate(timeout=60)
    finally:
        monitor.kill()
        nodes.kill()
    assert monitor.returncode == 0
    assert out.count('window of 10 s ending') == 2
    assert 'identifier: channel e1_a' in out and '● structural' in out
    # a mode of theory that a window of 10 s holds 63 cycles of: known to about 1 %
    found = [float(line.split()[1]) for line in out.splitlines() if ' ± ' in line]
    assert any(abs(f / 6.345 - 1) < 0.02 for f in found)
