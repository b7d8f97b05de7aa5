"""A rate that does not fit the stamps: found, named, left out; jitter and losses are none."""
import numpy as np
import pytest

from ssi_ros.bag import Channel, Recording
from ssi_ros.identify import Identification
from ssi_ros.identify.grid import Grid
from ssi_ros.identify.pace import fits, LONG, misfit, Pace
from ssi_ros.identify.stamped import identify_stamped
from ssi_ros.report.samples import samples_of

START = 1_700_000_000_000_000_000
SETTINGS = Identification(window_s=20.0, hop_s=5.0)


def stamps(seconds, rate_hz=100.0, start_s=0.0):
    """Return even stamps [ns]."""
    n = round(seconds * rate_hz)
    return START + np.rint((start_s + np.arange(n) / rate_hz) * 1e9).astype(np.int64)


def changed(first=100.0, then=80.0):
    """Return stamps whose rate changes after 30 s."""
    return np.concatenate([stamps(30, first), stamps(30, then, 30.0)])


def recording(*channels):
    """Return a recording of channels with these stamps."""
    rng = np.random.default_rng(4)
    return Recording(tuple(Channel(f'/{name}') for name, _ in zip('abcd', channels)), channels,
                     tuple(rng.standard_normal(len(c)) for c in channels), channels,
                     (False,) * len(channels))


@pytest.mark.parametrize('jitter', [0.0, 0.1, 0.2, 0.3, 0.45])
@pytest.mark.parametrize('kept', [1.0, 0.7, 0.3])
def test_jitter_and_losses_fit(jitter, kept, rng):
    """In 50 draws each, no uneven or thinned stamps of the right rate are called another rate."""
    for _ in range(50):
        ticks = np.arange(2000)[rng.random(2000) < kept][:256] + jitter * rng.standard_normal(256)
        assert fits(ticks + rng.random())


@pytest.mark.parametrize('rate', [0.3, 0.4, 0.66, 0.75, 0.8, 0.99, 0.997, 1.003, 1.01, 1.25, 2.0])
def test_another_rate_does_not_fit(rate, rng):
    """With a fifth lost and 5 % of jitter, 256 stamps at another rate are always known as such."""
    for _ in range(50):
        ticks = np.arange(2000)[rng.random(2000) < 0.8][:256] / rate
        assert not fits(ticks + 0.05 * rng.standard_normal(256))


@pytest.mark.parametrize('pieces', [1, 5, 600])
def test_a_changed_rate_begins_a_grid_at_the_new_one(pieces):
    """Estimated rate: both channels go to 80 Hz, and so does the grid; nothing is mixed."""
    grid, rows, both = Grid(('a', 'b')), [], changed()
    for part in np.array_split(both, pieces):
        for c in range(2):
            grid.push(c, part, np.arange(len(part)) + 1.0)
        rows += grid.rows()
    rows += grid.rows(flush=True)
    assert [r.rate_hz for r in rows if r.segment == 0][0] == 100.0
    assert {r.rate_hz for r in rows if r.segment == 1} == {80.0}
    assert len(grid.turns) == 1 and not grid.off_rate(0)
    # the block of 64 stamps that showed it, and the rest of the one before
    assert 0 <= grid.turns[0][0] - both[3000] < 128 * 12_500_000


def test_a_given_rate_stays_and_the_channel_is_left_out():
    """Given rate: the channel that changes is left out, until it fits again."""
    own = np.concatenate([changed(), stamps(30, 100.0, 60.0)])
    grid = Grid(('a', 'b'), 100.0)
    for c, s in enumerate((own, stamps(90))):
        grid.push(c, s, np.ones(len(s)))
    rows = grid.rows(flush=True)
    first = next(r for r in rows if r.segment == 1)
    late = np.concatenate([r.values for r in rows if r.segment == 1])
    begin = round((first.origin_ns - START) * 1e-9 * 100) + first.first
    assert np.isnan(late[:6000 - begin, 0]).all() and np.isfinite(late[6300 - begin:, 0]).all()
    assert np.isfinite(late[:, 1]).all() and grid.counts[0].off_rate > 2300
    assert grid.counts[1].off_rate == 0


def test_a_channel_beside_its_rate_is_left_out():
    """99.7 Hz beside twice 100 Hz: no sample of it is used, however few it would have cost."""
    grid = Grid(('a', 'b', 'c'))
    for c, s in enumerate((stamps(60, 99.7), stamps(60), stamps(60))):
        grid.push(c, s, np.ones(len(s)))
    rows = np.concatenate([r.values for r in grid.rows(flush=True)])
    assert grid.rate_hz == 100.0 and np.isnan(rows[:, 0]).all() and not np.isnan(rows[:, 1:]).any()


def test_a_wrong_rate_is_refused():
    """Half of the stamps' rate: no alias is identified, a sentence names both rates."""
    r = recording(stamps(60), stamps(60))
    with pytest.raises(ValueError, match='a comes at 100 Hz, not at the 50 Hz asked for'):
        identify_stamped(r.names, r.stamps_ns, r.values, SETTINGS, rate_hz=50.0)
    with pytest.raises(ValueError, match='a comes at 100 Hz, not at the 50 Hz asked for'):
        samples_of(r, 50.0)
    assert misfit('a', stamps(60)[::7], 100.0) != '' and misfit('a', stamps(60), 100.05) == ''


@pytest.mark.parametrize('others', [99.7, 80.0, 50.0])
def test_a_diagnosis_refuses_unequal_rates(others):
    """Samples on one grid are made of channels at one rate, or not at all; it says which."""
    with pytest.raises(ValueError, match=f'b comes at {others:g} Hz, not at the 100 Hz'):
        samples_of(recording(stamps(60), stamps(60, others), stamps(60)))


def test_a_diagnosis_refuses_a_rate_that_changes():
    """The answer says where to cut."""
    with pytest.raises(ValueError, match=r'rate of a changes before 3[01]\.\d s; cut'):
        samples_of(recording(changed(), changed()))


def test_many_blocks_at_once_are_judged_as_one_by_one(rng):
    """Stamps in one call and in calls of a few give the same verdicts, also where one goes off."""
    ticks = np.arange(4000) + 0.02 * rng.standard_normal(4000)
    ticks[2500:] = 2500 + 1.03 * (ticks[2500:] - 2500)
    one, few = Pace(), Pace()
    whole = one.take(ticks)
    parts = [few.take(ticks[i:i + 50]) for i in range(0, whole.lost_at, 50)]
    assert 2500 < whole.lost_at < 2500 + 2 * LONG
    assert whole.lost_at == 50 * (len(parts) - 1) + parts[-1].lost_at
    assert all(p.lost_at is None for p in parts[:-1])
    assert whole.use[:whole.lost_at].all() and not whole.use[whole.lost_at:].any()
