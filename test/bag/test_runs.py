"""Messages that are taken many at once are those that are taken one by one."""
import numpy as np
import pytest
from ssi_ros.bag import mcap_chunk
from ssi_ros.bag.mcap_chunk import messages_in
from ssi_ros.bag.mcap_file import MESSAGE_HEAD
from ssi_ros.bag.mcap_runs import LEAST


def chunk(sizes, channels):
    """Return message records of so many bytes each, channels in turn."""
    return b''.join(
        MESSAGE_HEAD.pack(5, 22 + size, channels[i % len(channels)], i, 10 * i, 10 * i + 1)
        + bytes((i + k) % 251 for k in range(size)) for i, size in enumerate(sizes))


@pytest.mark.parametrize('sizes', [
    [40] * 300, [40] * 100 + [41] + [40] * 100 + [8] * 90, [40, 44] * 80,
    [40] * (LEAST - 1) + [44] * 3, [0] * 100], ids=['one', 'broken', 'turns', 'short', 'empty'])
@pytest.mark.parametrize('most', [None, 12])
def test_runs_change_nothing(sizes, most, monkeypatch):
    """Times and bytes of every channel, wanted or not, are the same without runs."""
    records = chunk(sizes, (3, 1, 7))
    quick = messages_in(records, (1, 3), most)
    monkeypatch.setattr(mcap_chunk, 'run', lambda *_: np.empty(0))
    slow = messages_in(records, (1, 3), most)
    assert quick.keys() == slow.keys() == {1, 3}
    for channel, (logs, publishes, raws) in quick.items():
        assert (logs, publishes, list(raws)) == (*slow[channel][:2], list(slow[channel][2]))
        assert max(map(len, raws)) <= (99 if most is None else most)


def test_a_run_ends_with_the_piece():
    """A last record that is longer than the piece is an error, whole ones before it or not."""
    records = chunk([40] * 100, (1,))
    with pytest.raises(ValueError, match='longer than the piece'):
        messages_in(records[:-1])
    assert len(messages_in(records[:-1], strict=False)[1][0]) == 99
