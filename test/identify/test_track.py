"""Identities stay with their modes while the shapes of a close pair cannot be parted."""
import numpy as np
import pytest

from ssi_ros.identify import Identification, identify
from ssi_ros.identify.modes_json import modes_json
from ssi_ros.identify.track import PATIENCE, track, Tracks
from ssi_ros.records import Mode, Samples

SYMMETRIC, ANTISYMMETRIC = np.array([[1.0, 0.9, 1.0, 0.9], [1.0, 0.9, -1.0, -0.9]])


def mode(f, shape, phase=1.0, std=0.01):
    """Return a mode as an identification gives it, its shape with an arbitrary phase."""
    return Mode(f, 0.005, phase * np.asarray(shape, dtype=complex), std, 0.001)


def follow(windows):
    """Return the identities of the modes of every window, in the order given."""
    tracks, out = Tracks(), []
    for modes in windows:
        tracks, named, _, _ = track(tracks, modes)
        out.append([next(m.identity for m in named if m.shape is given.shape
                         or np.array_equal(m.shape, given.shape)) for given in modes])
    return out


def pair(angle, rng):
    """Return a pair 0.1 % apart, its shapes mixed by an angle and of any phase."""
    c, s = np.cos(angle), np.sin(angle)
    noise = 0.02 * rng.standard_normal((2, 4))
    phases = np.exp(2j * np.pi * rng.random(2))
    return [mode(15.828 + 0.01 * rng.standard_normal(), c * SYMMETRIC + s * ANTISYMMETRIC
                 + noise[0], phases[0]),
            mode(15.844 + 0.01 * rng.standard_normal(), c * ANTISYMMETRIC - s * SYMMETRIC
                 + noise[1], phases[1])]


@pytest.mark.parametrize('turn', [0.25, 0.5, 1.0])
def test_a_mixture_does_not_swap_a_pair(rng, turn):
    """The shapes turn into each other over ten windows; afterwards each name is where it was."""
    angles = [0.0] * 60 + list(np.linspace(0.0, turn * np.pi, 10)) + [0.0] * 60
    names = follow([pair(a, rng) for a in angles])
    assert names[-50:] == names[:1] * 50
    # half a turn exchanges the shapes, and with them the names: no third one is needed
    assert {n for window in names for n in window} == set(names[0])


def test_a_twin_alone_keeps_its_own_name(rng):
    """Whichever of the two is missed, the other keeps its name, and the missed one its own."""
    windows = [pair(0.0, rng) for _ in range(40)]
    gaps = [[w[k % 2]] for k, w in enumerate(windows[10:20])]
    names = follow(windows[:10] + gaps + windows[20:])
    first = names[0]
    assert names[10:20] == [[first[k % 2]] for k in range(10)]
    assert names[20:] == [first] * 20


def test_drift_is_followed(rng):
    """A mode that moves by a third of its spread a window, 10 % in all, keeps its name."""
    names = follow([[mode(5.0 * (1.0 + 1e-3 * k), SYMMETRIC, std=0.015)] for k in range(100)])
    assert names == [[1]] * 100


def test_births_and_deaths():
    """A mode elsewhere, or of a wholly other shape, is new; a lost one dies after its time."""
    tracks, _, births, _ = track(Tracks(), [mode(5.0, SYMMETRIC)])
    assert births == (1,)
    tracks, _, births, _ = track(tracks, [mode(5.2, SYMMETRIC)])
    assert births == (2,)
    tracks, _, births, _ = track(tracks, [mode(5.2, ANTISYMMETRIC)])
    assert births == (3,)
    died = []
    for _ in range(PATIENCE + 2):
        tracks, _, _, deaths = track(tracks, [])
        died.append(deaths)
    assert sorted(sum(died, ())) == [1, 2, 3] and tracks.alive == ()


def told_of(windows):
    """Return (splits, merges) of every window."""
    tracks, out = Tracks(), []
    for modes in windows:
        tracks = track(tracks, modes)[0]
        out.append((tracks.splits, tracks.merges))
    return out, tracks


@pytest.mark.parametrize('turn, kept', [(0.5, 1), (1.1, 2)])
def test_two_that_become_one_and_two_again(rng, turn, kept):
    """A mixture of both shapes is told as both; the name is that of the shape it is nearer to."""
    mixed = np.cos(turn) * SYMMETRIC + np.sin(turn) * ANTISYMMETRIC
    one = [[mode(15.836, mixed + 0.02 * rng.standard_normal(4))] for _ in range(10)]
    two = [pair(0.0, rng) for _ in range(10)]
    out, tracks = told_of(two + one + two)
    assert [k for k, o in enumerate(out) if o != ((), ())] == [10, 20]
    assert out[10] == ((), ((kept, 3 - kept),)) and out[20] == (((kept, 3 - kept),), ())
    assert len(tracks.alive) == 2
    names = follow(two + one + two)
    assert names[10:20] == [[kept]] * 10 and names[20:] == [[1, 2]] * 10


def test_one_that_becomes_two(rng):
    """A mode that was always seen as a mixture keeps its name with the nearer of the two."""
    mixed = [[mode(15.836, np.cos(0.5) * SYMMETRIC + np.sin(0.5) * ANTISYMMETRIC
                   + 0.02 * rng.standard_normal(4))] for _ in range(10)]
    out, _ = told_of(mixed + [pair(0.0, rng)] * 2)
    assert out[10] == (((1, 2),), ()) and out[11] == ((), ())


def test_a_mode_that_is_missed_or_born_is_no_merge_and_no_split(rng):
    """One of a pair is missed, or found for the first time, while the other stays as it was."""
    two = [pair(0.0, rng) for _ in range(20)]
    alone = [w[:1] for w in two]
    out, _ = told_of(two + alone + two)
    assert all(o == ((), ()) for o in out)
    out, _ = told_of(alone + two)
    assert all(o == ((), ()) for o in out)


def test_frequencies_that_meet_and_part(rng):
    """Two modes of one shape drift together and apart again: record, reason and names tell it."""
    n = 72000
    moving = np.interp(np.arange(n) / n, [0.0, 0.17, 0.33, 0.67, 0.83, 1.0],
                       [6.9, 6.9, 6.35, 6.35, 6.9, 6.9])
    values = np.zeros(n)
    for f in (np.full(n, 6.345), moving):
        mu = np.exp((-0.005 + 1j) * 2.0 * np.pi * f / 100.0)
        force, z = rng.standard_normal((n, 2)) @ [1.0, 1j], 0.0
        for k in range(n):
            z = mu[k] * z + force[k]
            values[k] += z.real
    values = values[:, None] + 0.05 * values.std() * rng.standard_normal((n, 4))
    settings = Identification(window_s=60.0, hop_s=5.0, bands=1)
    windows = identify(Samples(values, 100.0, tuple('abcd')), settings)
    events = [(w.merges, w.splits) for w in windows if w.merges or w.splits]
    first, last = events[0][0], events[-1][1]
    assert len(first) == len(last) == 1 and first[0][0] == last[0][0]
    merged = next(w for w in windows if w.merges)
    assert 'became one, which is seen as' in merged.reason
    assert modes_json([merged], 0)['windows'][0]['reason'] == merged.reason
    # one name from the first window to the last
    assert first[0][0] in {m.identity for m in windows[0].modes}
    assert first[0][0] in {m.identity for m in windows[-1].modes}
