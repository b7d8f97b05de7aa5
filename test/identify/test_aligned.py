"""Channels sampled beside the others are moved while they come, whoever bunched the rows."""
import numpy as np
import pytest
from ssi_ros.identify.aligned import Aligned, MARGIN
from ssi_ros.identify.grid import Grid

START_NS, N = 1_000_000_000_000_000_000, 6000


def motion(t):
    """Return an acceleration at times t [s]: lines between 0.4 Hz and 45 Hz."""
    return sum(np.sin(2 * np.pi * f * t + f) for f in (0.4, 2.3, 6.1, 12.7, 31.3, 45.0))


def rows_of(offset_s, pieces, lost=()):
    """Return aligned rows of two channels of one motion, the second sampled later."""
    grid, aligned, out = Grid(('a', 'b'), 100.0), Aligned(), []
    t = np.arange(N) / 100.0
    for part in np.array_split(np.delete(np.arange(N), lost), pieces):
        for c, later in enumerate((0.0, offset_s)):
            times = t[part] + later
            grid.push(c, START_NS + np.rint(times * 1e9).astype(np.int64), motion(times))
        for rows in grid.rows():
            out += aligned.push(rows, grid.offsets())
    return aligned, out


@pytest.mark.parametrize('offset_s', [0.003, -0.0045, 0.0003])
def test_moved_rows_are_those_of_one_instant(offset_s):
    """Of one motion both channels show the same but for the edges; bunching changes nothing."""
    aligned, out = rows_of(offset_s, 7)
    assert aligned.offsets[1] == pytest.approx(100.0 * offset_s, abs=1e-6)
    values = np.concatenate([r.values for r in out])
    assert [r.first for r in out] == list(np.cumsum([0] + [len(r.values) for r in out[:-1]]))
    assert len(values) >= N - 100 - 256 - MARGIN - 1
    apart = values[MARGIN:, 0] - values[MARGIN:, 1]
    assert np.nanstd(apart) < 0.01 * np.nanstd(values[:, 0])        # 0.9 unmoved at 3 ms
    assert np.isnan(apart).sum() == 0
    _, again = rows_of(offset_s, 61)
    values = [np.concatenate([r.values for r in some]) for some in (out, again)]
    size = min(map(len, values))
    np.testing.assert_array_equal(values[0][:size], values[1][:size])


@pytest.mark.parametrize('later', [(0.0, 0.0054, 0.0008), (0.0057, 0.0, 0.0016)])
def test_no_channel_is_a_whole_sample_off(later):
    """The rows of three channels begin with the last of them, and show one motion."""
    grid, aligned, out = Grid(('a', 'b', 'c'), 100.0), Aligned(), []
    for part in np.array_split(np.arange(N) / 100.0, 7):
        for c, offset_s in enumerate(later):
            times = part + offset_s
            grid.push(c, START_NS + np.rint(times * 1e9).astype(np.int64), motion(times))
        for rows in grid.rows():
            out += aligned.push(rows, grid.offsets())
    values = np.concatenate([r.values for r in out])[MARGIN:]
    for other in (1, 2):
        assert np.nanstd(values[:, 0] - values[:, other]) < 0.01 * np.nanstd(values[:, 0])


def test_rows_of_one_instant_pass_as_they_are():
    """Below 0.02 samples nothing is moved and nothing waits."""
    aligned, out = rows_of(0.0001, 7)
    assert not aligned.offsets.any()
    values = np.concatenate([r.values for r in out])
    np.testing.assert_allclose(values[:, 0], motion(np.arange(len(values)) / 100.0), atol=1e-5)
    assert len(values) >= N - 100


def test_a_gap_costs_its_edges():
    """32 rows on either side of a gap are missing in the moved channel, none in the other."""
    _, out = rows_of(0.003, 7, lost=np.arange(3000, 3010))
    gone = np.isnan(np.concatenate([r.values for r in out])[MARGIN:])
    assert gone[:, 0].sum() == 10 and gone[:, 1].sum() == 74
