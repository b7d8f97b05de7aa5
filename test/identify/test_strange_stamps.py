"""Stamps that no clock gives: answered or refused in a sentence, soon, with little memory."""

import numpy as np
import pytest

from ssi_ros.bag import Channel, Recording
from ssi_ros.identify import Identification
from ssi_ros.identify.grid import Grid
from ssi_ros.identify.stamped import identify_stamped
from ssi_ros.identify.stamps import batches
from ssi_ros.report.samples import samples_of

START, N = 1_700_000_000_000_000_000, 8_000
EVEN = START + np.arange(N, dtype=np.int64) * 10_000_000
LAST = 2 ** 63 - 1
DAY_NS = 86_400_000_000_000


def with_at(places, values):
    """Return even stamps with some replaced."""
    stamps = EVEN.copy()
    stamps[list(places)] = values
    return stamps


def gap(days):
    """Return even stamps with a gap in the middle."""
    stamps = EVEN.copy()
    stamps[N // 2:] += int(days * DAY_NS)
    return stamps


RNG = np.random.default_rng(3)
CASES = {
    'first stamps of 0': (with_at(range(3), 0), True),
    'first stamps of 1': (with_at(range(3), 1), True),
    'a last stamp': (with_at([0], LAST), True),
    'last stamps': (with_at(range(N - 3, N), LAST), True),
    'scattered': (with_at(range(0, N, 997), LAST), True),
    'scattered zeros': (with_at(range(0, N, 997), 0), True),
    'a month': (gap(30), True),
    '290 years': (np.where(np.arange(N) < N // 2, EVEN - START, EVEN), True),
    'equal': (np.full(N, START), False),
    'equal zeros': (np.zeros(N, np.int64), False),
    'negative': (-EVEN, False),
    'random': (RNG.integers(0, LAST, N), False),
    'reversed': (EVEN[::-1].copy(), None),
    'shuffled': (RNG.permutation(EVEN), None),
    '100 s apart': (START + np.arange(N) * 100_000_000_000, None),
    '700 s apart': (START + np.arange(N) * 700_000_000_000, None),
}


@pytest.mark.parametrize('lateness_s', (1.0, 0.0))
@pytest.mark.parametrize('name', CASES)
def test_any_stamps_are_answered_soon(name, lateness_s, rng):
    """Modes need not come, but an answer or a sentence."""
    stamps, answered = CASES[name]
    values = [rng.standard_normal(N), rng.standard_normal(N)]
    arrivals = np.sort(stamps)
    try:
        windows, grid = identify_stamped(
            ('a', 'b'), [stamps] * 2, values, Identification(), arrivals_ns=[arrivals] * 2,
            lateness_s=lateness_s)
        assert len(windows) and answered is not False
        if answered:
            placed = sum(c.placed for c in grid.counts)
            assert placed > 0.95 * 2 * N, grid.counts
    except ValueError as error:
        assert not answered and len(str(error).splitlines()) == 1, error


@pytest.mark.parametrize('name', CASES)
def test_any_recording_becomes_samples_or_a_sentence(name, rng):
    """The same for a diagnosis, which takes one grid only."""
    stamps, _ = CASES[name]
    arrivals = np.sort(stamps)
    recording = Recording((Channel('/a'), Channel('/b')), (stamps,) * 2,
                          (rng.standard_normal(N),) * 2, (arrivals,) * 2, (False,) * 2)
    try:
        assert samples_of(recording).values.size < 100_000_000
    except ValueError as error:
        assert len(str(error).splitlines()) == 1


@pytest.mark.parametrize('rate_hz', (1e-3, 1e4, 1e6))
def test_a_rate_that_fits_no_stamp_is_refused(rate_hz, rng):
    """Rows are not made a million times as many as samples."""
    stamps = START + np.arange(N) * 500_000_000_000
    try:
        windows, _ = identify_stamped(('a',), [stamps], [rng.standard_normal(N)],
                                      Identification(), rate_hz=rate_hz)
        assert not any(w.modes for w in windows)
    except ValueError as error:
        assert 'rate' in str(error) or 'sample' in str(error)


def test_a_gap_costs_no_batches():
    """Two samples thirty years apart make two batches, with both channels cut alike."""
    arrivals = [np.array([0, 10 ** 18]), np.array([10 ** 18 + 1])]
    assert batches(arrivals, 10 ** 10) == [(slice(0, 1), slice(0, 0)), (slice(1, 2), slice(0, 1))]
    assert batches([np.empty(0, np.int64)], 10) == []


def test_bad_stamps_at_the_end_are_counted(rng):
    """What waits for a jump to be confirmed when the record ends is counted as badly stamped."""
    stamps = EVEN[:1000].copy()
    stamps[-2:] += 10 ** 17
    grid = Grid(('a',))
    grid.push(0, stamps, rng.standard_normal(1000))
    assert len(grid.rows(flush=True)[0].values) == 998 and grid.counts[0].bad_stamps == 2
