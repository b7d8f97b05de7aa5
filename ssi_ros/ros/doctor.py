"""
Is this set-up right? Checks of the machine, each an answer with what to do about it.

What is on the ROS graph is checked in `doctor_graph`.
"""
from dataclasses import dataclass
from importlib import metadata, util
import os
from pathlib import Path
import shutil
import sys
import tempfile
import time

from ssi_ros.model.spacecraft import packaged
from ssi_ros.ros.loopback import PROFILES, shares_memory

LEVELS = ('ok', 'warn', 'error')
DISTRO = 'jazzy'
RECEIVE_BYTES = 2 << 20       # a second of 40 channels at 100 Hz, 500 B a message with its headers
FREE_BYTES = 1 << 30
SLOW_BYTES_S = 5e6            # four channels at 100 Hz need 0.1 MB/s, before compression
TRIAL_BYTES = 16 << 20
EXTRAS = (('textual', 'the screen of `ssi_ros monitor`', 'pip install textual'),
          ('foxglove', '`ssi_ros bridge`', 'pip install foxglove-sdk'))


@dataclass(frozen=True)
class Finding:
    """
    One answer.

    Attributes
    ----------
    level : str
        'ok', 'warn' or 'error'.
    what : str
        What was checked, a word or two.
    text : str
        What was found.
    fix : str
        What to do about it; empty where all is well.

    """

    level: str
    what: str
    text: str
    fix: str = ''


def machine(folder):
    """
    Return the findings on this machine.

    Parameters
    ----------
    folder : Path
        Where bags are going to be recorded.

    Returns
    -------
    list of Finding

    Raises
    ------
    ValueError
        If the folder does not exist.

    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ValueError(f'{folder} is no folder; give the one where bags are recorded')
    return [_ros(), _transport(), _receive_buffer(), _shared_memory(), *_extras(),
            _space(folder), _speed(folder)]


def _ros():
    python = f'Python {sys.version_info.major}.{sys.version_info.minor}'
    sourced = os.environ.get('ROS_DISTRO', '')
    if sourced and sourced != DISTRO:
        return Finding('warn', 'ROS 2', f'{sourced} is sourced, {python}; made and tested for '
                       f'{DISTRO}', f'source /opt/ros/{DISTRO}/setup.bash in a new terminal')
    try:
        origin = f'wheels {metadata.version("ros-jazzy-rclpy")}'
    except metadata.PackageNotFoundError:
        origin = 'sourced' if sourced else 'of unknown origin'
    level = 'ok' if sourced or origin.startswith('wheels') else 'warn'
    return Finding(level, 'ROS 2', f'{DISTRO} ({origin}), {python}' if level == 'ok' else
                   f'a distribution that is not named ({origin}), {python}',
                   '' if level == 'ok' else f'source /opt/ros/{DISTRO}/setup.bash')


def _transport():
    from rclpy.utilities import get_rmw_implementation_identifier
    name = get_rmw_implementation_identifier()
    kind = os.environ.get('FASTDDS_BUILTIN_TRANSPORTS', '')
    reach = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    text = (f'{name}, {kind or "default transports"}, domain '
            f'{os.environ.get("ROS_DOMAIN_ID", "0")}, discovery {reach}')
    if name != 'rmw_fastrtps_cpp':
        return Finding('warn', 'middleware', text + '; that a player waits for its readers was '
                       'tried with rmw_fastrtps_cpp only',
                       'export RMW_IMPLEMENTATION=rmw_fastrtps_cpp for all nodes')
    if shares_memory(os.environ):
        fix = 'export FASTDDS_BUILTIN_TRANSPORTS=UDPv4 for all nodes'
        if reach == 'LOCALHOST':
            fix = (f'export {PROFILES[0]}={packaged("loopback_udp.xml")} '
                   'ROS_AUTOMATIC_DISCOVERY_RANGE=SYSTEM_DEFAULT for all nodes')
        return Finding('warn', 'middleware', text + '; through shared memory a process that stood '
                       'still for a second may hear nothing afterwards', fix)
    return Finding('ok', 'middleware', text)


def _receive_buffer():
    try:
        most = int(Path('/proc/sys/net/core/rmem_max').read_text())
    except (OSError, ValueError):
        return Finding('ok', 'UDP buffer', 'its size is not known on this system')
    text = f'{most / 1024:.0f} KiB for what arrives while a process is busy'
    if most < RECEIVE_BYTES:
        return Finding('warn', 'UDP buffer', text + ': best-effort samples are lost in bursts',
                       f'sudo sysctl -w net.core.rmem_max={4 * RECEIVE_BYTES} '
                       f'net.core.rmem_default={4 * RECEIVE_BYTES}')
    return Finding('ok', 'UDP buffer', text)


def _shared_memory():
    folder = Path('/dev/shm')
    if not folder.is_dir():
        return Finding('ok', 'shared memory', 'there is no /dev/shm on this system')
    usage = shutil.disk_usage(folder)
    text = f'{usage.free / 2 ** 20:.0f} MiB free of {usage.total / 2 ** 20:.0f} MiB'
    if usage.free < 0.1 * usage.total:
        return Finding('warn', 'shared memory', text, 'fastdds shm clean')
    return Finding('ok', 'shared memory', text)


def _extras():
    return [Finding('ok', name, f'installed, for {purpose}') if util.find_spec(name) else
            Finding('warn', name, f'not installed: no {purpose}', fix)
            for name, purpose, fix in EXTRAS]


def _space(folder):
    free = shutil.disk_usage(folder).free
    text = f'{free / 1e9:.1f} GB free for bags in {folder.resolve().name or folder.resolve()}'
    if free < FREE_BYTES:
        return Finding('error', 'disk', text, 'make room, or record elsewhere (--folder)')
    return Finding('ok', 'disk', text)


def _speed(folder):
    try:
        with tempfile.NamedTemporaryFile(dir=folder, prefix='.ssi_ros_doctor') as trial:
            data, began = os.urandom(1 << 20), time.monotonic()
            for _ in range(TRIAL_BYTES >> 20):
                trial.write(data)
            trial.flush()
            os.fsync(trial.fileno())
            rate = TRIAL_BYTES / (time.monotonic() - began)
    except OSError as error:
        return Finding('error', 'write speed', f'nothing can be written: {error.strerror}',
                       'choose a folder that you may write to (--folder)')
    text = f'{rate / 1e6:.0f} MB/s, synced'
    if rate < SLOW_BYTES_S:
        return Finding('warn', 'write speed', text, 'record to a faster disk (--folder)')
    return Finding('ok', 'write speed', text)
