"""Identities stay with their modes while the shapes of a close pair cannot be parted."""
import numpy as np
import pytest

from ssi_ros.identify.track import PATIENCE, track, Tracks
from ssi_ros.records import Mode

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
    assert names == [[0]] * 100


def test_births_and_deaths():
    """A mode elsewhere, or of a wholly other shape, is new; a lost one dies after its time."""
    tracks, _, births, _ = track(Tracks(), [mode(5.0, SYMMETRIC)])
    assert births == (0,)
    tracks, _, births, _ = track(tracks, [mode(5.2, SYMMETRIC)])
    assert births == (1,)
    tracks, _, births, _ = track(tracks, [mode(5.2, ANTISYMMETRIC)])
    assert births == (2,)
    died = []
    for _ in range(PATIENCE + 2):
        tracks, _, _, deaths = track(tracks, [])
        died.append(deaths)
    assert sorted(sum(died, ())) == [0, 1, 2] and tracks.alive == ()
