"""Written bags against two independent readers, rosbags and mcap-ros2-support."""
import itertools
import os
import signal
import subprocess
import sys
import threading
import time

from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
import numpy as np
import pytest

from ssi_ros.bag import (
    BagWriter, encode_accel, open_bag, Qos, read_channels, recover, type_hash_of, write_samples)
from ssi_ros.bag.layout import ROOT, SENSOR
from ssi_ros.records import Samples
import yaml

ACCEL = 'geometry_msgs/msg/AccelStamped'
START = 1_700_000_000_000_000_000
NAMES = ('e1_a', 'e1_b', 'e2', 'long_name')         # lengths that pad differently


@pytest.fixture
def samples(rng):
    """Return 40 s of four channels with samples missing here and there, and a whole row."""
    values = rng.standard_normal((4000, 4))
    values[rng.random(values.shape) < 0.02] = np.nan
    values[17] = np.nan
    return Samples(values, 100.0, NAMES, START)


def present(samples, i):
    """Return stamps and values of the samples that are there."""
    kept = ~np.isnan(samples.values[:, i])
    return samples.stamps_ns()[kept], samples.values[kept, i]


def test_rosbags_reads_what_was_written(tmp_path, samples):
    """Values to the bit, stamps, counts, types, quality of service and hashes in rosbags."""
    reader = pytest.importorskip('rosbags.rosbag2').Reader
    typesys = pytest.importorskip('rosbags.typesys')
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    write_samples(tmp_path / 'bag', samples, extra={'seed': 7})
    with reader(tmp_path / 'bag') as bag:
        found = {c.topic: ([], []) for c in bag.connections}
        for connection, log, raw in bag.messages():
            message = store.deserialize_cdr(raw, connection.msgtype)
            stamp = message.header.stamp.sec * 10 ** 9 + message.header.stamp.nanosec
            assert stamp == log
            assert message.header.frame_id == connection.topic.rsplit('/', 1)[-1]
            found[connection.topic][0].append(stamp)
            found[connection.topic][1].append(message.accel.linear.z)
        for i, c in enumerate(sorted(bag.connections, key=lambda c: c.id)):
            stamps, values = present(samples, i)
            assert c.topic == f'/accelerometer/{NAMES[i]}' and c.msgtype == ACCEL
            assert c.digest == type_hash_of(ACCEL) == store.hash_rihs01(ACCEL)
            assert c.msgcount == len(stamps)
            qos = c.ext.offered_qos_profiles[0]
            assert (qos.reliability.name, qos.depth, qos.history.name, qos.durability.name) == (
                'BEST_EFFORT', 5, 'KEEP_LAST', 'VOLATILE')
            assert found[c.topic][0] == stamps.tolist()
            assert found[c.topic][1] == values.tolist()
    assert open_bag(tmp_path / 'bag').custom_data == {'seed': '7'}


@pytest.mark.parametrize('compression', ('zstd', 'lz4', 'none'))
def test_mcap_ros2_support_reads_what_was_written(tmp_path, compression):
    """Message by message through BagWriter, read with its checksums by the mcap packages."""
    decoder = pytest.importorskip('mcap_ros2.decoder').DecoderFactory
    stamps = START + np.arange(500) * 10_000_000
    raws = encode_accel(stamps, np.arange(500.0), 'a')
    with BagWriter(tmp_path / 'bag', compression=compression) as bag:
        bag.add_topic('/a', ACCEL, Qos())
        for stamp, raw in zip(stamps.tolist(), raws):
            bag.write('/a', raw, stamp + 5, stamp)
    path = tmp_path / 'bag' / 'bag_0.mcap'
    with open(path, 'rb') as f:
        reader = make_reader(f, validate_crcs=True, decoder_factories=[decoder()])
        summary = reader.get_summary()
        assert summary.statistics.message_count == 500
        assert {c.compression for c in summary.chunk_indexes} == {
            '' if compression == 'none' else compression}
        got = [(m.log_time, m.publish_time, d.accel.linear.z)
               for _, _, m, d in reader.iter_decoded_messages()]
        assert got == [(int(s) + 5, int(s), float(i)) for i, s in enumerate(stamps)]
        assert reader.get_header().profile == 'ros2'
    with open(path, 'rb') as f:                  # the CRC of the data section is checked too
        records = list(StreamReader(f, validate_crcs=True).records)
    names = [r.name for r in records if type(r).__name__ == 'Metadata']
    assert names == ['rosbag2', 'rosbag2']       # at open and at close
    read = read_channels(tmp_path / 'bag')
    assert read.values[0].tolist() == list(range(500))
    assert (read.arrivals_ns[0] - read.stamps_ns[0] == 5).all()


def test_message_indexes_point_at_messages(tmp_path, samples):
    """A seek by time, which uses the message indexes, finds exactly the messages of its range."""
    write_samples(tmp_path / 'bag', samples)
    first, last = START + 10 * 10 ** 9, START + 11 * 10 ** 9
    with open(tmp_path / 'bag' / 'bag_0.mcap', 'rb') as f:
        got = [(c.topic, m.log_time) for _, c, m in make_reader(f).iter_messages(
            topics=['/accelerometer/e2'], starting_at=first, ending_before=last)]
    stamps = present(samples, 2)[0]
    wanted = stamps[(stamps >= first) & (stamps < last)]
    assert [t for _, t in got] == wanted.tolist()
    own = open_bag(tmp_path / 'bag').messages(['/accelerometer/e2'], first, last)
    assert [m.log_ns for m in own] == wanted.tolist()


def test_metadata_is_rosbag2_version_9(tmp_path, samples):
    """The keys of metadata.yaml, in the order in which rosbag2 Jazzy writes them."""
    write_samples(tmp_path / 'bag', samples)
    info = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())[ROOT]
    assert list(info) == [
        'version', 'storage_identifier', 'duration', 'starting_time', 'message_count',
        'topics_with_message_count', 'compression_format', 'compression_mode',
        'relative_file_paths', 'files', 'custom_data', 'ros_distro']
    assert info['version'] == 9 and info['storage_identifier'] == 'mcap'
    assert info['message_count'] == int((~np.isnan(samples.values)).sum())
    assert info['starting_time']['nanoseconds_since_epoch'] == START
    assert info['duration']['nanoseconds'] == 3999 * 10_000_000
    topic = info['topics_with_message_count'][0]['topic_metadata']
    assert topic['offered_qos_profiles'] == [SENSOR.plain()]


@pytest.mark.parametrize('split', ({'split_s': 1.0}, {'split_bytes': 20_000}))
def test_splits_are_one_bag(tmp_path, split, rng):
    """Splits by time and by size hold every message once, for our reader and for rosbags."""
    reader = pytest.importorskip('rosbags.rosbag2').Reader
    stamps = START + np.arange(4000) * 1_000_000
    # a clock that runs 1 ms a message makes a chunk every 100 of them
    clock = itertools.count(0.0, 0.001)
    with BagWriter(tmp_path / 'bag', flush_s=0.1, clock=lambda: next(clock), **split) as bag:
        bag.add_topic('/a', ACCEL)
        for stamp, raw in zip(stamps.tolist(), encode_accel(stamps, rng.random(4000), 'a')):
            bag.write('/a', raw, stamp, stamp)
    files = sorted(p.name for p in (tmp_path / 'bag').glob('*.mcap'))
    assert len(files) == 4 if 'split_s' in split else len(files) > 2, files
    assert [m.log_ns for m in open_bag(tmp_path / 'bag').messages()] == stamps.tolist()
    with reader(tmp_path / 'bag') as bag:
        assert [log for _, log, _ in bag.messages()] == stamps.tolist()


CRASH = """
import sys, time
import numpy as np
from ssi_ros.bag import BagWriter, encode_accel
names = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
with BagWriter(sys.argv[1]) as bag:
    for name in names:
        bag.add_topic('/accelerometer/' + name, 'geometry_msgs/msg/AccelStamped')
    due = time.monotonic()
    while True:
        now = time.time_ns()
        for name in names:
            raw = encode_accel(np.array([now]), np.array([1.0]), name)[0]
            bag.write('/accelerometer/' + name, raw, now, now)
        print(now, flush=True)
        due += 0.01
        time.sleep(max(0.0, due - time.monotonic()))
"""


def crash_after(folder, seconds):
    """Kill -9 a process that records 4 x 100 Hz after so long; return its last stamp [ns]."""
    with subprocess.Popen([sys.executable, '-c', CRASH, str(folder)], text=True,
                          stdout=subprocess.PIPE) as process:
        first = int(process.stdout.readline())
        time.sleep(seconds)
        os.kill(process.pid, signal.SIGKILL)
        lines = [int(line) for line in process.stdout.read().splitlines() if len(line) == 19]
    return max([first, *lines])


@pytest.mark.parametrize('seconds', (0.83, 1.37, 2.05))
def test_a_killed_recording_loses_little_and_recovers(tmp_path, seconds):
    """After kill -9 at most 0.6 s are lost, and the recovered bag opens in both readers."""
    reader = pytest.importorskip('rosbags.rosbag2').Reader
    last = crash_after(tmp_path / 'bag', seconds)
    with pytest.raises(ValueError, match='ssi_ros recover'):
        open_bag(tmp_path / 'bag')
    report = recover(tmp_path / 'bag', tmp_path / 'sound')
    # the flush period of 0.5 s and 0.1 s for a machine that is busy
    assert 0 <= (last - report.last_ns) / 1e9 <= 0.6
    read = read_channels(tmp_path / 'sound')
    with reader(tmp_path / 'sound') as bag:
        assert bag.message_count == sum(report.saved.values()) == sum(map(len, read.values))
    assert all(n > 20 for n in report.saved.values())


FULL = """
import itertools, resource, sys
import numpy as np
from ssi_ros.bag import BagWriter, encode_accel
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
stamps = np.arange(200_000, dtype=np.int64) * 1_000_000 + 10 ** 18
raws = encode_accel(stamps, np.random.default_rng(1).random(len(stamps)), 'a')
clock = itertools.count(0.0, 0.001)
bag = BagWriter(sys.argv[1], flush_s=0.1, clock=lambda: next(clock))
bag.add_topic('/a', 'geometry_msgs/msg/AccelStamped')
try:
    for stamp, raw in zip(stamps.tolist(), raws):
        bag.write('/a', raw, stamp, stamp)
except OSError as error:
    print(error)
bag.close()
print(sum(bag._counts.values()))
"""


def test_a_full_disk_is_told_and_keeps_what_was_written(tmp_path):
    """At a file-size limit `write` says so, and every message before the limit recovers."""
    done = subprocess.run([sys.executable, '-c', FULL, str(tmp_path / 'bag')], text=True,
                          capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr
    said, flushed = done.stdout.strip().rsplit('\n', 1)
    assert 'are kept in' in said and 'ssi_ros recover' in said and int(flushed) > 200
    report = recover(tmp_path / 'bag', tmp_path / 'sound')
    assert report.saved == {'/a': int(flushed)}                # nothing flushed is lost
    assert report.salvaged == 0                                # the file ends with a whole record
    assert len(read_channels(tmp_path / 'sound').values[0]) == int(flushed)


def test_a_stream_that_stops_is_flushed(tmp_path):
    """A message is on disk soon after `flush_s` although no other follows it."""
    bag = BagWriter(tmp_path / 'bag', flush_s=0.05)
    bag.add_topic('/a', ACCEL)
    bag.write('/a', encode_accel(np.array([5]), np.array([1.0]), 'a')[0], 5, 5)
    until = time.monotonic() + 5.0                 # 100 flush periods: it does come
    written = False
    while not written and time.monotonic() < until:
        time.sleep(0.02)
        written = b'zstd' in (tmp_path / 'bag' / 'bag_0.mcap').read_bytes()    # a chunk is there
    bag.close()
    assert written


def test_two_threads_may_write(tmp_path):
    """Writers in two threads lose nothing and mix nothing up."""
    with BagWriter(tmp_path / 'bag', flush_s=0.01) as bag:
        def fill(name):
            stamps = START + np.arange(5000)
            for stamp, raw in zip(stamps.tolist(), encode_accel(stamps, np.arange(5e3), name)):
                bag.write(f'/{name}', raw, stamp, stamp)
        for name in 'ab':
            bag.add_topic(f'/{name}', ACCEL)
        threads = [threading.Thread(target=fill, args=(n,)) for n in 'ab']
        for t in threads:
            t.start()
        for t in threads:
            t.join()
    read = read_channels(tmp_path / 'bag')
    assert [v.tolist() for v in read.values] == [list(range(5000))] * 2


def test_mistakes_are_told(tmp_path, samples):
    """Existing folders, unknown topics and words, and names that are no topics."""
    (tmp_path / 'there').mkdir()
    with pytest.raises(ValueError, match='never overwritten'):
        BagWriter(tmp_path / 'there')
    with pytest.raises(ValueError, match='one of zstd, lz4, none'):
        BagWriter(tmp_path / 'new', compression='gzip')
    assert not (tmp_path / 'new').exists()
    with pytest.raises(ValueError, match='not a topic name'):
        write_samples(tmp_path / 'new', Samples([[1.0]], 1.0, ('a b',)))
    with pytest.raises(ValueError, match='one a channel'):
        write_samples(tmp_path / 'new', samples, topics=('/a',))
    with BagWriter(tmp_path / 'new') as bag:
        bag.add_topic('/a', ACCEL, {'reliability': 'best_effort', 'depth': 3})
        with pytest.raises(ValueError, match='already'):
            bag.add_topic('/a', ACCEL)
        with pytest.raises(ValueError, match='must be one of'):
            bag.add_topic('/c', ACCEL, {'reliability': 'perhaps'})
        with pytest.raises(ValueError, match='the bag has /a'):
            bag.write('/b', b'', 0, 0)
    with pytest.raises(ValueError, match='is closed'):
        bag.write('/a', b'', 0, 0)
