"""
Read and run the launch files of this package where `launch` and `launch_ros` are not installed.

It knows the classes that they use, each with the meaning that it has in ROS 2 Jazzy: what a
substitution becomes as text, how a text becomes a parameter of one type, which arguments a node
gets, what happens when a process ends. A class or a keyword that it does not know is an error.

    python test/launch_reader.py launch/replay.launch.py bag:=night_1 rate:=10.0
"""
from dataclasses import dataclass
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time
from types import ModuleType

import yaml

ROOT = Path(__file__).resolve().parent.parent
GRACE_S = 10.0                # from SIGINT to SIGTERM, and from there to SIGKILL
TICK_S = 0.02


def text_of(value, arguments):
    """Return a substitution, a text, or a list of both, as text."""
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return ''.join(text_of(v, arguments) for v in value)
    return value.text(arguments)


@dataclass(frozen=True)
class LaunchConfiguration:
    """An argument of the launch file."""

    name: str

    def text(self, arguments):
        """Return what was given, or the default."""
        return arguments[self.name]


class PathJoinSubstitution:
    """Parts of a path."""

    def __init__(self, parts):
        self.parts = parts

    def text(self, arguments):
        """Return the parts joined."""
        return str(Path(*(text_of(p, arguments) for p in self.parts)))


@dataclass(frozen=True)
class FindPackageShare:
    """The folder of an installed package: here that of the sources, which is laid out alike."""

    package: str

    def text(self, arguments):
        """Return the folder."""
        if self.package != 'ssi_ros':
            raise LookupError(f'package {self.package!r} is not found')
        return str(ROOT)


@dataclass(frozen=True)
class NotEqualsSubstitution:
    """Whether two texts differ: `true` or `false`."""

    left: object
    right: object

    def text(self, arguments):
        """Return the answer in small letters, as launch does."""
        return str(text_of(self.left, arguments) != text_of(self.right, arguments)).lower()


class PythonExpression:
    """An expression of Python, put together from texts."""

    def __init__(self, expression):
        self.expression = expression

    def text(self, arguments):
        """Return the value of the expression as text: a flag is `True` or `False`."""
        return str(eval(text_of(self.expression, arguments)))


@dataclass(frozen=True)
class ParameterValue:
    """A text that becomes a parameter of one type."""

    value: object
    value_type: type

    def typed(self, arguments):
        """Return the parameter; ValueError where the text is no such value."""
        text = text_of(self.value, arguments)
        if self.value_type is not bool:
            return self.value_type(text)
        flag = yaml.safe_load(text)
        if not isinstance(flag, bool):
            raise ValueError(f'Cannot convert value {text!r} to {bool}')
        return flag


class IfCondition:
    """A text that decides whether an action is carried out."""

    def __init__(self, predicate):
        self.predicate = predicate

    def holds(self, arguments):
        """Return the answer; ValueError for a text that is none."""
        text = text_of(self.predicate, arguments).strip().lower()
        if text not in ('true', '1', 'false', '0'):
            raise ValueError(f'invalid condition {text!r}')
        return text in ('true', '1')


@dataclass(frozen=True)
class DeclareLaunchArgument:
    """An argument that may be given, or must where it has no default."""

    name: str
    description: str
    default_value: object = None


@dataclass(frozen=True)
class Shutdown:
    """End all processes."""

    reason: str


@dataclass(frozen=True)
class TimerAction:
    """Carry actions out after a time [s]."""

    period: float
    actions: list


@dataclass(frozen=True)
class Node:
    """A process of a node."""

    package: str
    executable: str
    name: str
    output: str
    parameters: tuple = ()
    condition: object = None
    on_exit: object = None

    def command(self, arguments, folder):
        """Return the command line; dicts of parameters become files in the folder, in order."""
        words = [sys.executable, '-m', f'ssi_ros.ros.{self.executable}', '--ros-args',
                 '-r', f'__node:={self.name}']
        for number, given in enumerate(self.parameters):
            if isinstance(given, dict):
                values = {k: v.typed(arguments) if isinstance(v, ParameterValue) else v
                          for k, v in given.items()}
                path = Path(folder) / f'{self.name}_{number}.yaml'
                path.write_text(yaml.dump({'/**': {'ros__parameters': values}}))
            else:
                path = text_of(given, arguments)
            words += ['--params-file', str(path)]
        return words


class LaunchDescription(tuple):
    """The actions of a launch file."""


MODULES = {
    'launch': {'LaunchDescription': LaunchDescription},
    'launch.actions': {c.__name__: c for c in (DeclareLaunchArgument, Shutdown, TimerAction)},
    'launch.conditions': {'IfCondition': IfCondition},
    'launch.substitutions': {c.__name__: c for c in (
        LaunchConfiguration, NotEqualsSubstitution, PathJoinSubstitution, PythonExpression)},
    'launch_ros': {},
    'launch_ros.actions': {'Node': Node},
    'launch_ros.parameter_descriptions': {'ParameterValue': ParameterValue},
    'launch_ros.substitutions': {'FindPackageShare': FindPackageShare},
}


def description_of(path):
    """Return the description of a launch file, read with the classes of this module."""
    before = {name: sys.modules.get(name) for name in MODULES}
    for name, members in MODULES.items():
        sys.modules[name] = ModuleType(name)
        vars(sys.modules[name]).update(members)
    try:
        names = {}
        exec(compile(Path(path).read_text(), str(path), 'exec'), names)
        return names['generate_launch_description']()
    finally:
        for name, module in before.items():
            sys.modules.pop(name)
            if module is not None:
                sys.modules[name] = module


class Launch:
    """A launch file that runs: its processes, and what happens when one of them ends."""

    def __init__(self, path, given, folder=None, environment=None):
        self.folder = Path(folder or tempfile.mkdtemp(prefix='launch_'))
        self.environment, self.reason, self.timers = environment, None, []
        actions = description_of(path)
        declared = [a for a in actions if isinstance(a, DeclareLaunchArgument)]
        arguments = {a.name: a.default_value for a in declared} | given
        missing = [name for name, value in arguments.items() if value is None]
        if missing:
            raise RuntimeError(f'required launch argument {missing[0]!r} was not provided')
        self.nodes = {a.name: a for a in actions if isinstance(a, Node) and (
            a.condition is None or a.condition.holds(arguments))}
        self.commands = {name: node.command(arguments, self.folder)
                         for name, node in self.nodes.items()}
        self.running, self.codes = {}, {}

    def start(self, log=True):
        """Start the processes; what they print goes to files in the folder, or to the screen."""
        for name, command in self.commands.items():
            out = open(self.folder / f'{name}.txt', 'w') if log else None
            self.running[name] = subprocess.Popen(command, stdout=out, stderr=out,
                                                  env=self.environment)
        return self

    def carry_out(self, action):
        """Carry out what a node names for its end."""
        if isinstance(action, Shutdown):
            self.shut_down(action.reason)
        elif isinstance(action, TimerAction):
            self.timers.append((time.monotonic() + action.period, action.actions))
        elif action is not None:
            raise TypeError(f'{type(action).__name__} is not known here')

    def step(self):
        """See which processes have ended and which timers have; return whether any still runs."""
        for name, process in list(self.running.items()):
            if process.poll() is not None:
                self.codes[name] = self.running.pop(name).returncode
                if self.reason is None:
                    self.carry_out(self.nodes[name].on_exit)
        for due in [t for t in self.timers if t[0] <= time.monotonic()]:
            self.timers.remove(due)
            for action in due[1]:
                self.carry_out(action)
        return bool(self.running) or bool(self.timers)

    def wait(self, patience_s):
        """Return when all has ended; TimeoutError if that takes too long."""
        end = time.monotonic() + patience_s
        while self.step():
            if time.monotonic() > end:
                raise TimeoutError(f'{sorted(self.running)} still run after {patience_s} s')
            time.sleep(TICK_S)
        return self.codes

    def shut_down(self, reason):
        """End all processes as launch does: SIGINT, then SIGTERM, then SIGKILL."""
        self.reason, self.timers = reason, []
        for sign in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for process in self.running.values():
                process.send_signal(sign)
            end = time.monotonic() + GRACE_S
            while self.running and time.monotonic() < end:
                self.step()
                time.sleep(TICK_S)


def main(words):
    """Run a launch file as `ros2 launch` would, until it ends or ctrl-C."""
    launch = Launch(words[0], dict(w.split(':=', 1) for w in words[1:])).start(log=False)
    try:
        launch.wait(float('inf'))
    except KeyboardInterrupt:
        launch.shut_down('ctrl-C')
    print(f'ended: {launch.reason or "all processes have ended"}; exit codes {launch.codes}')


if __name__ == '__main__':
    main(sys.argv[1:])
