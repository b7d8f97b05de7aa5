"""What is intact on the disk is recovered: bits, bytes and ends of files damaged, seeded."""
import shutil

from mcap.writer import Writer
import numpy as np
import pytest

from ssi_ros.bag import (
    BagWriter, definition_of, encode_accel, open_bag, read_channels, recover)
from ssi_ros.bag.mcap_contents import contents_of, summary_of

ACCEL = 'geometry_msgs/msg/AccelStamped'
START = 1_700_000_000_000_000_000
COUNT, CHUNKS = 3000, 12
STAMPS = START + np.arange(COUNT) * 10_000_000


@pytest.fixture(scope='module', params=('zstd', 'lz4', 'none'))
def whole(request, tmp_path_factory):
    """Return the bytes of a file of 12 chunks and the messages of each."""
    folder = tmp_path_factory.mktemp('whole')
    values = np.random.default_rng(1).standard_normal(COUNT)
    with BagWriter(folder / 'bag', compression=request.param, flush_s=1e9) as bag:
        bag.add_topic('/a', ACCEL)
        for i, (stamp, raw) in enumerate(zip(STAMPS.tolist(), encode_accel(STAMPS, values, 'a'))):
            bag.write('/a', raw, stamp, stamp)
            if i % (COUNT // CHUNKS) == COUNT // CHUNKS - 1:
                bag._seal()
    path = folder / 'bag' / 'bag_0.mcap'
    return path.read_bytes(), values, contents_of(path)


def recovered(data, values, folder):
    """Recover a file, check that every sample saved is one of the originals; return how many."""
    folder.mkdir()
    (folder / 'x.mcap').write_bytes(data)
    report = recover(folder / 'x.mcap', folder / 'sound')
    if not sum(report.saved.values()):
        return 0, report
    read = read_channels(folder / 'sound')
    places = (read.stamps_ns[0] - START) // 10_000_000
    assert np.array_equal(read.values[0], values[places])
    shutil.rmtree(folder)
    return len(places), report


def test_one_bit_costs_one_chunk_at_most(whole, tmp_path):
    """Of 60 files with one bit flipped somewhere, each loses one chunk of twelve or nothing."""
    data, values, contents = whole
    rng = np.random.default_rng(9)
    lost = []
    for i in range(60 if 'zstd' in contents.compressions else 40):
        bad = bytearray(data)
        bad[rng.integers(len(data))] ^= 1 << rng.integers(8)
        saved, report = recovered(bad, values, tmp_path / str(i))
        lost.append(COUNT - saved)
        assert lost[-1] <= COUNT // CHUNKS, (i, report)
        assert lost[-1] == 0 or report.bytes_dropped > 0, (i, report)
    assert 0 < sum(lost)                            # some do hit a chunk


def test_every_byte_outside_of_the_chunks_can_be_lost(whole, tmp_path):
    """Schemas, channels, metadata, indexes, heads of chunks, summary, footer, magic: all saved."""
    data, values, contents = whole
    inside = np.zeros(len(data), bool)
    for piece in contents.pieces:
        inside[piece.offset + 24:piece.offset + piece.size] = True        # CRC and records
    outside = np.flatnonzero(~inside)
    rng = np.random.default_rng(10)
    tried = 60 if 'zstd' in contents.compressions else 40
    for i, at in enumerate(rng.choice(outside, tried, replace=False).tolist()):
        bad = bytearray(data)
        bad[at] ^= int(rng.integers(1, 256))
        saved, report = recovered(bad, values, tmp_path / str(i))
        assert saved == COUNT, (at, report)


def test_a_file_may_end_anywhere(whole, tmp_path):
    """Cut in every byte of the head of a chunk that follows damage."""
    data, values, contents = whole
    at = contents.pieces[6].offset - 9
    for cut in range(60):
        bad = bytearray(data[:at + cut])
        bad[contents.pieces[5].offset - 4] ^= 1                  # a length
        saved, report = recovered(bad, values, tmp_path / str(cut))
        assert saved >= 5 * COUNT // CHUNKS, report


def test_a_part_that_is_overwritten_costs_its_chunks(whole, tmp_path):
    """4 kB of zeros or noise cost the chunks they touch, and no other."""
    data, values, contents = whole
    ends = np.array([(p.offset, p.offset + p.size) for p in contents.pieces])
    rng = np.random.default_rng(11)
    for i in range(12):
        at = int(rng.integers(8, len(data) - 4096))
        hit = ((ends[:, 0] < at + 4096) & (ends[:, 1] > at)).sum()
        bad = bytearray(data)
        bad[at:at + 4096] = rng.bytes(4096) if i % 2 else bytes(4096)
        saved, report = recovered(bad, values, tmp_path / str(i))
        assert COUNT - saved <= hit * COUNT // CHUNKS, (at, report)


def test_messages_outside_of_chunks_survive_a_damaged_length(tmp_path):
    """A file without chunks or checksums goes on behind a message whose length is damaged."""
    with open(tmp_path / 'x.mcap', 'wb') as f:
        writer = Writer(f, use_chunking=False)
        writer.start()
        schema = writer.register_schema(ACCEL, 'ros2msg', definition_of(ACCEL).encode())
        channel = writer.register_channel('/a', 'cdr', schema)
        for stamp, raw in zip(STAMPS.tolist(), encode_accel(STAMPS, np.arange(3000.0), 'a')):
            writer.add_message(channel, stamp, raw, stamp)
        writer.finish()
    data = bytearray((tmp_path / 'x.mcap').read_bytes())
    assert open_bag(tmp_path / 'x.mcap').message_count == COUNT
    at = data.index(b'\5' + (22 + len(raw)).to_bytes(8, 'little'), len(data) // 2)
    data[at + 3] ^= 0x10
    (tmp_path / 'y.mcap').write_bytes(data)
    report = recover(tmp_path / 'y.mcap', tmp_path / 'sound')
    assert report.unchecked > 0
    assert report.saved['/a'] >= COUNT - 2 and 'damaged part' in report.damage[0], report


def test_a_checked_summary_is_believed_before_a_broken_schema(whole, tmp_path):
    """A schema that still parses, but names another field first, gives way to the sound one."""
    data, values, _ = whole
    at = data.index(b'float64 x')
    bad = data[:at] + b'float64 w' + data[at + 9:]
    saved, report = recovered(bad, values, tmp_path / 'a')
    assert saved == COUNT and report.saved == {'/a': COUNT}


def test_the_summary_of_a_sound_file_is_checked(whole, tmp_path):
    """A bit of the summary is noticed by its checksum, and reported with what to do."""
    data, _, _ = whole
    (tmp_path / 'x.mcap').write_bytes(data)
    with open(tmp_path / 'x.mcap', 'rb') as f:
        start = summary_of(f, len(data)).start
    bad = bytearray(data)
    bad[start + 30] ^= 1
    (tmp_path / 'x.mcap').write_bytes(bad)
    with pytest.raises(ValueError, match='damaged summary.*ssi_ros recover'):
        open_bag(tmp_path / 'x.mcap')


def test_two_damaged_copies_of_a_definition(tmp_path):
    """
    Both lose a member and can still be read: the hash of the type tells which member is missing.

    Without the hash nothing vouches for either, and it is said that values may be wrong.
    """
    stamps = 10 ** 18 + np.arange(300, dtype=np.int64) * 10_000_000
    values = np.sin(np.arange(300))
    for known in (True, False):
        bag = tmp_path / f'bag_{known}'
        with BagWriter(bag) as writer:
            writer.add_topic('/a', 'geometry_msgs/msg/AccelStamped',
                             **({} if known else {'type_hash': 'RIHS01_' + '0' * 64,
                                                  'definition': definition_of(
                                                      'geometry_msgs/msg/AccelStamped')}))
            for stamp, raw in zip(stamps.tolist(), encode_accel(stamps, values, 'frame')):
                writer.write('/a', raw, stamp, stamp)
        path = bag / f'bag_{known}_0.mcap'
        data = path.read_bytes()
        # the last member of the header is gone from both copies, in two ways
        first = data.index(b'string frame_id')
        last = data.rindex(b'string frame_id')
        assert first != last
        data = data[:first] + b' ' * 15 + data[first + 15:]
        data = data[:last] + b'#tring frame_id' + data[last + 15:]
        (tmp_path / 'x.mcap').write_bytes(data)
        report = recover(tmp_path / 'x.mcap', tmp_path / f'out_{known}')
        assert report.saved == {'/a': 300}
        if known:
            found = read_channels(tmp_path / f'out_{known}')
            np.testing.assert_array_equal(found.values[0], values)
            assert 'is that of this machine' in report.damage[0]
        else:
            assert 'values of /a may be wrong' in report.damage[0]
