"""Bags of other writers, damaged bags, and the mistakes of a reader."""
import shutil

from mcap.writer import CompressionType, IndexType, Writer
import numpy as np
import pytest

from ssi_ros.bag import (
    BagWriter, Channel, definition_of, encode_accel, open_bag, parse_channel, read_channels,
    recover, write_samples)
from ssi_ros.bag.channels import _Column
from ssi_ros.records import Samples

ACCEL = 'geometry_msgs/msg/AccelStamped'
FLOAT = 'std_msgs/msg/Float64'
START = 1_700_000_000_000_000_000
STAMPS = START + np.arange(600) * 10_000_000


def float_cdr(value):
    """Return a std_msgs/Float64 in CDR."""
    return b'\0\1\0\0' + np.float64(value).tobytes()


@pytest.fixture
def bag(tmp_path, rng):
    """Return the folder of a bag of two channels, 6 s."""
    write_samples(tmp_path / 'bag', Samples(rng.standard_normal((600, 2)), 100.0, ('a', 'b'),
                                            START))
    return tmp_path / 'bag'


@pytest.mark.parametrize('options', (
    {}, {'use_chunking': False}, {'compression': CompressionType.LZ4, 'chunk_size': 2000},
    {'compression': CompressionType.NONE}, {'index_types': IndexType.NONE},
    {'use_statistics': False}, {'repeat_channels': False, 'repeat_schemas': False,
                                'use_statistics': False, 'use_summary_offsets': False,
                                'index_types': IndexType.NONE}), ids=str)
def test_a_foreign_mcap_reads(tmp_path, options):
    """Any layout of the mcap package's own writer, with names as other tools write them."""
    path = tmp_path / 'foreign.mcap'
    with open(path, 'wb') as f:
        writer = Writer(f, **options)
        writer.start()
        # the type without /msg, as some converters write it
        schema = writer.register_schema('geometry_msgs/AccelStamped', 'ros2msg',
                                        definition_of(ACCEL).encode())
        other = writer.register_channel('/x', 'json', 0)
        channel = writer.register_channel('/imu/a', 'cdr', schema)
        order = np.random.default_rng(3).permutation(600)         # not in log order
        raws = encode_accel(STAMPS, np.arange(600.0), 'frame')
        for i in order.tolist():
            writer.add_message(channel, int(STAMPS[i]), raws[i], int(STAMPS[i]))
        writer.add_message(other, START, b'{}', START)
        writer.finish()
    read = read_channels(path)
    assert read.names == ('a',) and read.values[0].tolist() == list(range(600))
    assert read.stamps_ns[0].tolist() == STAMPS.tolist()
    logs = [m.log_ns for m in open_bag(path).messages(['/imu/a'])]
    assert logs == STAMPS.tolist()
    assert [t.count for t in sorted(open_bag(path).topics, key=lambda t: t.name)] == [600, 1]


def test_sqlite_bags_read(tmp_path):
    """A .db3 bag that rosbags wrote reads as its MCAP twin would."""
    rosbag2 = pytest.importorskip('rosbags.rosbag2')
    raws = encode_accel(STAMPS, np.arange(600.0), 'a')
    with rosbag2.Writer(tmp_path / 'sql', version=9) as writer:
        connection = writer.add_connection('/a', ACCEL, msgdef=definition_of(ACCEL), rihs01='x')
        for stamp, raw in zip(STAMPS.tolist(), raws):
            writer.write(connection, stamp, raw)
    read = read_channels(tmp_path / 'sql')
    assert read.values[0].tolist() == list(range(600))
    assert [m.raw for m in open_bag(tmp_path / 'sql').messages()] == raws


def test_a_type_without_header_is_stamped_by_log_time(tmp_path):
    """Log time stands in where there is no header stamp or all of them are 0, and this is told."""
    with BagWriter(tmp_path / 'bag') as bag:
        bag.add_topic('/f', FLOAT)
        bag.add_topic('/zero', ACCEL)
        zero = encode_accel(np.zeros(600, np.int64), np.arange(600.0), 'a')
        for i, stamp in enumerate(STAMPS.tolist()):
            bag.write('/f', float_cdr(i), stamp, stamp)
            bag.write('/zero', zero[i], stamp, stamp)
    read = read_channels(tmp_path / 'bag', [Channel('/f', FLOAT, 'data', 'f'),
                                            parse_channel('/zero')])
    assert read.by_log_time == (True, True) and read.names == ('f', 'zero')
    for stamps, values in zip(read.stamps_ns, read.values):
        assert stamps.tolist() == STAMPS.tolist() and values.tolist() == list(range(600))


def test_two_channels_of_one_topic(bag):
    """Two fields of one topic are two channels."""
    read = read_channels(bag, [parse_channel('/accelerometer/a'),
                               parse_channel('/accelerometer/a:header.stamp.sec')])
    assert read.names == ('a', 'a.header.stamp.sec')
    assert read.values[1].tolist() == (read.stamps_ns[0] // 10 ** 9).tolist()


@pytest.mark.parametrize('channel, words', (
    (Channel('/nope'), ('no topic /nope', '/accelerometer/a', ACCEL)),
    (Channel('/accelerometer/a', FLOAT, 'data'), (ACCEL, FLOAT)),
    (Channel('/accelerometer/a', ACCEL, 'accel.q'), ('accel.linear.z',))))
def test_a_wrong_channel_is_explained(bag, channel, words):
    """A missing topic, a wrong type and a wrong field name what exists."""
    with pytest.raises(ValueError) as error:
        read_channels(bag, [channel])
    assert all(w in str(error.value) for w in words), error.value


def test_bags_without_accelerometers_list_what_they_have(tmp_path):
    """Without an accelerometer the numeric topics are listed; without a message, that is said."""
    with BagWriter(tmp_path / 'other') as bag:
        bag.add_topic('/f', FLOAT)
        bag.add_topic('/s', 'std_msgs/msg/String')
        bag.write('/f', float_cdr(1.0), 1, 1)
    with pytest.raises(ValueError, match=r'numeric topics: /f \(std_msgs/msg/Float64: data\)$'):
        read_channels(tmp_path / 'other')
    with BagWriter(tmp_path / 'none') as bag:
        bag.add_topic('/a', ACCEL)
    assert open_bag(tmp_path / 'none').message_count == 0
    with pytest.raises(ValueError, match='holds no messages'):
        read_channels(tmp_path / 'none')


def test_what_is_no_bag_is_told(tmp_path, bag):
    """Nothing, an empty folder or file, text, a ROS 1 bag and a missing split."""
    (tmp_path / 'folder').mkdir()
    for name, content in (('empty.mcap', b''), ('text.mcap', b'hello, I am not a bag'),
                          ('one.bag', b'#ROSBAG V2.0\n...')):
        (tmp_path / name).write_bytes(content)
    for name, words in (('nowhere', 'does not exist'), ('folder', 'is not a bag'),
                        ('empty.mcap', 'is empty'), ('text.mcap', 'not an MCAP'),
                        ('one.bag', 'ROS 1 bag; convert')):
        with pytest.raises(ValueError, match=words):
            open_bag(tmp_path / name)
    (bag / 'bag_0.mcap').unlink()
    with pytest.raises(ValueError, match='lacks the file bag_0.mcap'):
        open_bag(bag)


def test_every_cut_recovers_all_that_is_whole(tmp_path, rng):
    """Cut anywhere, a bag is told to be cut, and recovers a prefix that grows with the cut."""
    with BagWriter(tmp_path / 'bag', compression='none', flush_s=1e9) as bag:
        bag.add_topic('/a', ACCEL)
        for stamp, raw in zip(STAMPS.tolist(), encode_accel(STAMPS, np.arange(600.0), 'a')):
            bag.write('/a', raw, stamp, stamp)
    whole = (tmp_path / 'bag' / 'bag_0.mcap').read_bytes()
    before = 0
    for i, cut in enumerate(np.sort(rng.integers(3000, len(whole), 12)).tolist()):
        path = tmp_path / f'{i}.mcap'
        path.write_bytes(whole[:cut])
        with pytest.raises(ValueError, match='ssi_ros recover'):
            open_bag(path)
        report = recover(path, tmp_path / f'sound_{i}')
        saved = report.saved['/a']
        # 104 bytes a message record: at most one message and the heads of the file are lost
        assert saved >= min(600, (cut - 4000) // 104) and saved >= before
        before = saved
        if saved:
            read = read_channels(tmp_path / f'sound_{i}')
            assert read.values[0].tolist() == list(range(saved))
            assert report.last_ns == read.arrivals_ns[0][-1]


@pytest.mark.parametrize('compression', ('zstd', 'lz4', 'none'))
def test_a_cut_inside_a_chunk_salvages_messages(tmp_path, compression, rng):
    """Of a chunk that is cut in the middle the messages before the cut are saved."""
    stamps = START + np.arange(9000) * 10_000_000
    with BagWriter(tmp_path / 'bag', compression=compression, flush_s=1e9) as bag:
        bag.add_topic('/a', ACCEL)
        for stamp, raw in zip(stamps.tolist(), encode_accel(stamps, rng.random(9000), 'a')):
            bag.write('/a', raw, stamp, stamp)
    whole = (tmp_path / 'bag' / 'bag_0.mcap').read_bytes()
    (tmp_path / 'cut.mcap').write_bytes(whole[:len(whole) // 2])
    report = recover(tmp_path / 'cut.mcap', tmp_path / 'sound')
    # zstd and lz4 decompress in blocks of up to 128 KiB, about 1200 messages
    assert report.salvaged > 2000 and report.salvaged == report.saved['/a'], report
    assert open_bag(tmp_path / 'sound').message_count == report.salvaged


def test_a_flipped_bit_costs_one_chunk(tmp_path, rng):
    """A damaged chunk is noticed by its checksum, and recovery saves all the others."""
    stamps = START + np.arange(3000) * 10_000_000
    with BagWriter(tmp_path / 'bag', compression='none', flush_s=1e9) as bag:
        bag.add_topic('/a', ACCEL)
        for i, (stamp, raw) in enumerate(zip(stamps.tolist(),
                                             encode_accel(stamps, rng.random(3000), 'a'))):
            bag.write('/a', raw, stamp, stamp)
            if i % 1000 == 999:
                bag._seal()
    path = tmp_path / 'bag' / 'bag_0.mcap'
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4                         # the middle of the second chunk of three
    path.write_bytes(data)
    with pytest.raises(ValueError, match='checksum.*ssi_ros recover'):
        read_channels(tmp_path / 'bag')
    report = recover(tmp_path / 'bag', tmp_path / 'sound')
    assert report.saved == {'/a': 2000} and '1 damaged chunk' in report.damage[0]


def test_a_missing_metadata_yaml_is_made_anew(tmp_path, bag):
    """Without metadata.yaml a bag opens all the same, and recovery writes the same one."""
    kept = (bag / 'metadata.yaml').read_text()
    (bag / 'metadata.yaml').unlink()
    assert open_bag(bag).message_count == 1200
    report = recover(bag, tmp_path / 'again' / 'bag')
    assert (tmp_path / 'again' / 'bag' / 'metadata.yaml').read_text() == kept
    assert report.damage == () and report.bytes_dropped == 0
    with pytest.raises(ValueError, match='never overwritten'):
        recover(bag, tmp_path / 'again')
    shutil.rmtree(bag)
    bag.mkdir()
    with pytest.raises(ValueError, match='nothing to recover'):
        recover(bag, tmp_path / 'new')


@pytest.mark.parametrize('size', [1, 7, 1000])
def test_columns_in_pieces_are_whole_again(size, monkeypatch, rng):
    """Times that rise, fall and lie years apart, and values: as they were put in."""
    monkeypatch.setattr('ssi_ros.bag.channels._PIECE', size)
    times = np.cumsum(rng.integers(-2 ** 31, 2 ** 31, 100)) + 10 ** 18
    times[37] += 10 ** 17
    for numbers in (times, rng.standard_normal(100)):
        column = _Column(100)
        for part in np.array_split(numbers, 9):
            column.append(part)
        column.append(None)
        found = column.whole()
        assert found.dtype == numbers.dtype and np.array_equal(found, numbers)
    assert _Column(5).whole() is None


def test_times_that_channels_share_are_kept_once(tmp_path, rng):
    """Of channels that were sampled and arrived together."""
    write_samples(tmp_path / 'bag', Samples(rng.standard_normal((50, 3)), 10.0, tuple('abc')))
    found = read_channels(tmp_path / 'bag')
    assert {id(a) for part in (found.stamps_ns, found.arrivals_ns) for a in part} == {
        id(found.arrivals_ns[0])}
    assert len({id(v) for v in found.values}) == 3
