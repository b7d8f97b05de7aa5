"""
The main job in one command: simulate, identify live, record, replay, compare.

Four processes talk over DDS on this machine alone: simulator, identifier, recorder, and this one,
which watches the topics. Then a player and a second identifier do it again from the bag.
"""
from dataclasses import dataclass
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from ssi_ros.ros.loopback import udp_alone
from ssi_ros.ros.messages import window_of
from ssi_ros.ros.node import ros_arguments

STARTUP_S = 20.0
GRACE_S = 15.0
# Reliable samples are late, never lost, while a process stands still: the identifiers wait for
# them, six seconds on the wall at ten times real time.
LATENESS_S = 60.0


@dataclass(frozen=True)
class Outcome:
    """What the demo has seen: windows of the live run and of the replay, by their end [ns]."""

    bag: Path
    live: dict
    replayed: dict
    live_s: float
    replay_s: float


class Processes:
    """The nodes, each in a process of its own, ended together."""

    def __init__(self, log_folder):
        log_folder.mkdir(parents=True, exist_ok=True)
        # a domain of its own, so that nobody else's topics are mixed in
        os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
        os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        # a process that stands still for a second may lose its queues in shared memory for good
        os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')
        self.log_folder = log_folder
        self.environment = dict(os.environ, ROS_LOG_DIR=str(log_folder.resolve()),
                                **udp_alone(os.environ))
        self.running = {}

    def start(self, name, node, remaps=(), **settings):
        """Start a node; settings become parameters, remaps are FROM:=TO."""
        command = [sys.executable, '-m', f'ssi_ros.ros.{node}_node',
                   *ros_arguments(settings, [*remaps, f'__node:={name}'])]
        with open(self.log_folder / f'{name}.txt', 'w') as log:
            self.running[name] = subprocess.Popen(
                command, env=self.environment, stdout=log, stderr=subprocess.STDOUT)

    def check(self):
        """Raise OSError if a node has ended with an error."""
        for name, process in self.running.items():
            if process.poll() not in (None, 0):
                self.fail(name)

    def fail(self, name):
        """Raise OSError with the last words of a node."""
        words = (self.log_folder / f'{name}.txt').read_text().strip().splitlines()[-5:]
        raise OSError(f'{name} ended with exit code {self.running[name].returncode}: '
                      + ' | '.join(words))

    def stop(self, *names):
        """End nodes as an operator would, with SIGINT, and see that they ended well."""
        for name in names:
            self.running[name].send_signal(signal.SIGINT)
        for name in names:
            process = self.running[name]
            if process.wait(timeout=GRACE_S) != 0:
                self.fail(name)
            del self.running[name]

    def kill(self):
        """End whatever still runs."""
        for process in self.running.values():
            process.kill()
            process.wait()


class Watcher:
    """Listen to the modes of an identifier."""

    def __init__(self):
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node('demo')
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)
        self.windows = {}

    def listen(self, name):
        """Collect the windows of the identifier of that name from now on; a dict by end."""
        windows = self.windows[name] = {}

        def collect(msg):
            window = window_of(msg)
            windows[window.end_ns] = window
        self.node.create_subscription(DiagnosticArray, f'/{name}/modes', collect, 100)
        return windows

    def spin(self, seconds):
        """Let messages come in."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=left)

    def close(self):
        """Release everything."""
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()


def run(folder, *, duration_s, window_s, hop_s, speed, seed, say, progress):
    """
    Run the demo.

    Parameters
    ----------
    folder : Path
        Where the bag and the logs go; must not hold a bag yet.
    duration_s, window_s, hop_s : float
        Length of the simulation, of the window and of the hop [s].
    speed : float
        Simulated seconds a second.
    seed : int
        Seed of the simulation.
    say : callable
        Called with a line of text at every step and every window.
    progress : callable
        Called with the share of the work that is done.

    Returns
    -------
    Outcome

    Raises
    ------
    OSError
        If a node does not start, or ends with an error; with its last words.

    """
    bag = folder / 'bag'
    processes, watcher = Processes(folder / 'log'), Watcher()
    total_s = 2.0 * duration_s / speed
    try:
        began = time.monotonic()
        live = watcher.listen('identifier')
        processes.start('identifier', 'identifier', window_s=window_s, hop_s=hop_s,
                        expected_rate_hz=100.0 * speed, lateness_s=LATENESS_S, reliable=True)
        processes.start('recorder', 'recorder', bag=bag, use_sim_time=True)
        processes.start('simulator', 'simulator', seed=seed, speed=speed, duration_s=duration_s,
                        wait_for_subscribers=2, reliable=True)
        say(f'step 1 of 3, live: simulator, identifier, recorder and this watcher; {duration_s:g} '
            f's at {speed:g} times real time; the window is full after {window_s / speed:.0f} s, '
            f'then a line each {hop_s / speed:.2g} s')
        _follow(processes, watcher, live, 'simulator', duration_s, window_s, hop_s, speed, say,
                lambda s: progress(s / total_s))
        processes.stop('identifier', 'recorder')
        live_s = time.monotonic() - began
        say(f'step 2 of 3, replay: player and a second identifier on {bag}, '
            f'{duration_s / speed:.0f} s again')
        began = time.monotonic()
        replayed = watcher.listen('identifier_replay')
        processes.start('identifier_replay', 'identifier', window_s=window_s, hop_s=hop_s,
                        expected_rate_hz=100.0 * speed, lateness_s=LATENESS_S, reliable=True)
        processes.start('player', 'player', bag=bag, rate=speed, wait_for_subscribers=1,
                        reliable=True, topics=['/accelerometer/.*'])
        _follow(processes, watcher, replayed, 'player', duration_s, window_s, hop_s, speed, say,
                lambda s: progress((s + duration_s / speed) / total_s))
        processes.stop('identifier_replay')
        return Outcome(bag, dict(live), dict(replayed), live_s, time.monotonic() - began)
    finally:
        processes.kill()
        watcher.close()


def _follow(processes, watcher, windows, source, duration_s, window_s, hop_s, speed, say,
            progress):
    """Wait until the source has ended and the last window has come; tell of each window."""
    expected = int((duration_s - window_s) / hop_s + 1e-6) + 1
    began, told = time.monotonic(), 0
    most_s = STARTUP_S + 3.0 * duration_s / speed + GRACE_S
    while len(windows) < expected:
        watcher.spin(0.1)
        processes.check()
        spent = time.monotonic() - began
        progress(min(spent, duration_s / speed))
        for end_ns in list(windows)[told:]:
            say(line_of(windows[end_ns], min(windows), window_s))
            told += 1
        ended = processes.running[source].poll() is not None
        if spent > most_s or (ended and len(windows) < expected and _quiet(watcher, windows)):
            raise OSError(f'{len(windows)} of {expected} windows came; the logs are in '
                          f'{processes.log_folder}')
    if processes.running[source].wait(timeout=GRACE_S) != 0:
        processes.fail(source)
    del processes.running[source]


def _quiet(watcher, windows):
    before = len(windows)
    watcher.spin(5.0)
    return len(windows) == before


def line_of(window, first_end_ns, window_s):
    """Return a window as one line for the terminal."""
    end_s = (window.end_ns - first_end_ns) * 1e-9 + window_s
    if not window.modes:
        return f'  {end_s:6.1f} s: no modes: {window.reason}'
    found = ' '.join(f'{m.frequency_hz:.3f}' for m in window.modes)
    return f'  {end_s:6.1f} s: {len(window.modes):2d} modes [Hz]: {found}'
