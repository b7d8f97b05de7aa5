"""A bag may name any type and topic: only installed interfaces are imported, nothing is run."""
import os
from pathlib import Path
import subprocess
import sys

import pytest

pytest.importorskip('rclpy', reason='ROS 2 is not installed')

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy                  # noqa: E402

from ssi_ros.bag import BagWriter, definition_of                           # noqa: E402
from ssi_ros.bag.play import shift_first_stamp                             # noqa: E402
from ssi_ros.ros.channels import message_class                             # noqa: E402
from ssi_ros.ros.replayed_qos import publisher_qos                         # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
FLOAT = 'std_msgs/msg/Float64'


def trap(folder, package):
    """Put a package into a folder that leaves a file behind when it is imported."""
    (folder / package / 'msg').mkdir(parents=True)
    (folder / package / '__init__.py').write_text('')
    (folder / package / 'msg' / '__init__.py').write_text(
        f"open({str(folder / 'ran')!r}, 'w').close()\nclass Evil: pass\n")


@pytest.mark.parametrize('name', (
    'evilpkg/msg/Evil', 'os/path/join', 'std_msgs/msg/../String', 'Std_msgs/msg/String',
    'std_msgs/msg/string', 'std__msgs/msg/String', 'std_msgs/msg/String\n', 'a/b', '', 3))
def test_what_is_no_installed_type_is_not_imported(tmp_path, monkeypatch, name):
    """A package in the working folder, a module of Python, a name outside of the grammar."""
    trap(tmp_path, 'evilpkg')
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend('')
    with pytest.raises(ValueError, match='not the name of a message type|not installed'):
        message_class(name)
    assert not (tmp_path / 'ran').exists()
    assert message_class(FLOAT).__name__ == 'Float64'


def test_a_package_that_claims_to_be_installed_is_not_imported(tmp_path, monkeypatch):
    """A .msg under a prefix does not make a module of the working folder an interface."""
    trap(tmp_path / 'here', 'evilpkg')
    share = tmp_path / 'prefix' / 'share' / 'evilpkg' / 'msg'
    share.mkdir(parents=True)
    (share / 'Evil.msg').write_text('float64 data\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path / 'prefix'))
    monkeypatch.syspath_prepend(str(tmp_path / 'here'))
    with pytest.raises(ValueError, match='not installed for Python'):
        message_class('evilpkg/msg/Evil')
    assert not (tmp_path / 'here' / 'ran').exists()


def test_play_runs_nothing_of_the_working_folder(tmp_path):
    """`python -m ssi_ros play`, in a folder with the type's package and a module of Python."""
    trap(tmp_path, 'evilpkg')
    (tmp_path / 'yaml.py').write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    with BagWriter(tmp_path / 'bag') as bag:
        for topic, kind in (('/evil', 'evilpkg/msg/Evil'), ('/no name', FLOAT), ('/f', FLOAT)):
            bag.add_topic(topic, kind, [{'deadline': 1, 'depth': 10 ** 30, 'reliability': []}],
                          definition=definition_of(FLOAT), type_hash='')
            bag.write(topic, b'\0\1\0\0' + bytes(8), 10 ** 18, 10 ** 18)
    done = subprocess.run(
        [sys.executable, '-m', 'ssi_ros', 'play', 'bag'], cwd=tmp_path, text=True,
        capture_output=True, timeout=60, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    words = done.stdout + done.stderr
    assert done.returncode == 0 and '1 messages played' in words, words
    assert '/evil' in words and 'not installed' in words and 'not a topic name' in words
    assert 'Traceback' not in words and not (tmp_path / 'ran').exists()


def test_quality_of_service_of_others():
    """Words, numbers of older bags, and what is neither."""
    assert publisher_qos([{'reliability': 2}]).reliability == ReliabilityPolicy.BEST_EFFORT
    assert publisher_qos([{'durability': 1}]).durability == DurabilityPolicy.TRANSIENT_LOCAL
    for depth in (-1, 10 ** 30, 'deep', None, [1]):
        assert publisher_qos([{'depth': depth}]).depth == 5000


def test_a_stamp_that_cannot_be_moved_stays():
    """A message that ends before its stamp, and a stamp that would leave those of ROS."""
    assert shift_first_stamp(b'\0\1\0\0', 5) == b'\0\1\0\0'
    late = b'\0\1\0\0' + (2 ** 31 - 1).to_bytes(4, 'little') + bytes(4)
    assert shift_first_stamp(late, 2_000_000_000) == late


@pytest.mark.parametrize('node, parameters, words', (
    ('simulator', {'namespace': 'a b'}, 'not a topic name'),
    ('simulator', {'namespace': '9'}, 'not a topic name'),
    ('simulator', {'start_s': 2147483640.0, 'duration_s': 100.0}, '2038'),
    ('player', {'topics': ['[']}, 'regular expression'),
    ('identifier', {'channels': ['{topic: 3}']}, 'write text'),
    ('identifier', {'channels': ['{topic: /a b}']}, 'not a topic name'),
    ('identifier', {'channels': ['[' * 5000]}, 'not YAML')))
def test_parameters_that_name_nothing_are_refused(tmp_path, node, parameters, words):
    """Topics that are no text, namespaces that are none, stamps beyond 2038."""
    from ssi_ros.bag import write_samples
    from ssi_ros.records import Samples
    write_samples(tmp_path / 'bag', Samples([[0.0]] * 10, 10.0, ('a',), 10 ** 18))
    given = {**parameters, **({'bag': str(tmp_path / 'bag')} if node == 'player' else {})}
    arguments = [a for k, v in given.items() for a in ('-p', f'{k}:={v!r}')]
    done = subprocess.run(
        [sys.executable, '-m', f'ssi_ros.ros.{node}_node', '--ros-args', *arguments], text=True,
        capture_output=True, timeout=60, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    said = done.stdout + done.stderr
    assert done.returncode and words in said and 'Traceback' not in said, said
