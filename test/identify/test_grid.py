"""Stamps to rows: exact, whatever the bunching; every fault counted and survived."""
import numpy as np
import pytest

from ssi_ros.identify.grid import Grid
from ssi_ros.identify.stamps import Phase

START = 1_700_000_000_000_000_000


def stream(n, rate_hz=100.0, start_ns=START):
    """Return stamps and two channels of numbered samples."""
    stamps = start_ns + np.rint(np.arange(n) * 1e9 / rate_hz).astype(np.int64)
    return stamps, np.arange(n) + 1.0, -np.arange(n) - 1.0


def rows_of(grid, flush=True):
    """Return all rows of the last segment as one array."""
    blocks = grid.rows(flush)
    last = [b.values for b in blocks if b.segment == grid.segment]
    return np.concatenate(last) if last else np.empty((0, len(grid.channels)))


def test_plain():
    """Every sample finds its row, the rate is exact."""
    grid = Grid(('a', 'b'))
    stamps, a, b = stream(1000)
    grid.push(0, stamps, a)
    grid.push(1, stamps, b)
    rows = rows_of(grid)
    assert grid.rate_hz == 100.0 and grid.origin_ns == START
    np.testing.assert_array_equal(rows, np.column_stack([a, b]))


@pytest.mark.parametrize('rate_hz', [15.0, 60.0, 100.0, 400.0, 1000.0 / 3.0])
def test_rate_is_estimated(rate_hz):
    """The rate from stamps rounded to a nanosecond is right to 1e-7 with 20 % of them lost."""
    stamps, a, _ = stream(3000, rate_hz)
    keep = np.random.default_rng(1).random(3000) > 0.2
    keep[0] = True
    grid = Grid(('a',))
    grid.push(0, stamps[keep], a[keep])
    rows = rows_of(grid)
    assert grid.rate_hz == pytest.approx(rate_hz, rel=1e-6)   # 7 digits are kept
    placed = np.isfinite(rows[:, 0])
    np.testing.assert_array_equal(rows[placed, 0], a[:len(rows)][placed])


def test_bunching_does_not_matter(rng):
    """Rows are equal to the bit however the messages are bunched, with losses and jitter."""
    stamps, a, b = stream(5000)
    jitter = np.rint(rng.normal(0.0, 1e6, 5000)).astype(np.int64)
    results = []
    for pieces in (1, 7, 400):
        grid = Grid(('a', 'b'))
        got = []
        for part in np.array_split(np.arange(5000), pieces):
            kept = part[(part % 97 != 0)]
            grid.push(0, (stamps + jitter)[part], a[part])
            grid.push(1, (stamps - jitter)[kept], b[kept])
            got += grid.rows()
        got += grid.rows(flush=True)
        results.append(np.concatenate([g.values for g in got]))
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])
    assert np.count_nonzero(np.isnan(results[0][:, 1])) == len(range(97, 5000, 97))


def test_drifting_clock_keeps_the_count():
    """A clock 300 ppm off the given rate loses and doubles nothing that it did not have to."""
    stamps, a, _ = stream(60000, 100.03)
    grid = Grid(('a',), rate_hz=100.0)
    grid.push(0, stamps, a)
    rows = rows_of(grid)
    assert len(rows) == 60000 and grid.counts[0].missing == 0


def test_faults_are_counted():
    """Duplicates, NaN, zero stamps, disorder: each is counted and the rest is placed."""
    stamps, a, _ = stream(1000)
    stamps, a = stamps.copy(), a.copy()
    stamps = np.concatenate([stamps, stamps[-1:]])           # a duplicate
    a = np.concatenate([a, [77.0]])
    a[100] = np.inf
    stamps[200] = 0
    stamps[[300, 301]] = stamps[[301, 300]]
    a[[300, 301]] = a[[301, 300]]
    grid = Grid(('a',))
    grid.push(0, stamps, a)
    rows, count = rows_of(grid), grid.counts[0]
    assert (count.duplicates, count.not_finite, count.bad_stamps) == (1, 1, 1)
    assert count.out_of_order == 1 and count.missing == 2
    expected = np.arange(1000) + 1.0
    expected[[100, 200]] = np.nan
    np.testing.assert_array_equal(rows[:, 0], expected)


def test_duplicate_of_a_row_that_went_on_is_no_late_sample():
    """How samples are bunched does not change what is counted."""
    stamps, a, _ = stream(1000)
    grid = Grid(('a',))
    grid.push(0, stamps, a)
    assert len(rows_of(grid, flush=False)) == 1000
    grid.push(0, stamps[-1:], [77.0])
    grid.push(0, stamps[-5:-4], [77.0])
    assert not grid.rows()
    assert (grid.counts[0].duplicates, grid.counts[0].late) == (1, 1)


def test_silent_channel_does_not_hold_up_the_others():
    """Rows go on without a silent channel once they are a second old."""
    stamps, a, _ = stream(1000)
    grid = Grid(('a', 'silent'))
    grid.push(0, stamps, a)
    rows = rows_of(grid, flush=False)
    assert len(rows) == 900 and np.isnan(rows[:, 1]).all()


@pytest.mark.parametrize('jump_s', [-30.0, -5.0, 3600.0])
def test_clock_jump_begins_a_segment(jump_s):
    """Both channels jump: a new segment, all old rows handed out, nothing mixed."""
    stamps, a, b = stream(2000)
    stamps[1000:] += int(jump_s * 1e9)
    grid = Grid(('a', 'b'), max_gap_s=60.0)
    got = []
    for part in np.array_split(np.arange(2000), 40):
        grid.push(0, stamps[part], a[part])
        grid.push(1, stamps[part], b[part])
        got += grid.rows()
    got += grid.rows(flush=True)
    if jump_s == -5.0:                    # 5 s back, then the same again: later than allowed
        assert len(grid.jumps) == 1
    first = np.concatenate([g.values for g in got if g.segment == 0])
    second = np.concatenate([g.values for g in got if g.segment == 1])
    np.testing.assert_array_equal(first[:, 0], a[:1000])
    np.testing.assert_array_equal(second[:, 1], b[1000:])


def test_one_wild_stamp_is_no_jump():
    """A single stamp far in the future is dropped, the clock stays."""
    stamps, a, _ = stream(1000)
    stamps[500] += 10 ** 17
    grid = Grid(('a',))
    grid.push(0, stamps, a)
    rows = rows_of(grid)
    assert not grid.jumps and len(rows) == 1000 and grid.counts[0].bad_stamps == 1


def test_other_rate_is_seen():
    """A channel at half the rate shows in its count."""
    stamps, a, b = stream(1000)
    grid = Grid(('a', 'b'))
    grid.push(0, stamps, a)
    grid.push(1, stamps[::2], b[::2])
    rows_of(grid)
    assert grid.rate_hz in (50.0, 75.0, 100.0)
    assert grid.counts[1].rate_hz == pytest.approx(50.0)


def test_a_phase_that_stays_is_followed_in_large_steps(rng):
    """Ticks and phase of stamps in one piece are those of stamps in small ones, to the bit."""
    since = np.arange(9000) * 1e7
    since[3000:3600] += rng.uniform(-2e6, 2e6, 600)
    since[6000:] += 3e6                # a step, which is followed block by block
    whole = Phase(0.0)
    index, parts = whole.index(since, 1e7), Phase(0.0)
    assert np.array_equal(index, np.concatenate([
        parts.index(part, 1e7) for part in np.array_split(since, 90)]))
    assert whole.phase_ns == parts.phase_ns > 2e6
    assert np.array_equal(index, np.arange(9000))
