"""How well the ends of a sweep are known."""
import numpy as np
import pytest
from ssi_ros.events.track import stds_of_ends

DURATION_S = 600.0


def test_ends_of_a_sweep_that_is_seen_all_the_time():
    """Those of a parabola through phases: sqrt(48) / (pi T) at d' = 1."""
    assert stds_of_ends(np.ones(60_001), DURATION_S) == pytest.approx(
        2 * [np.sqrt(48) / np.pi / DURATION_S], rel=1e-3)


def test_an_end_that_the_channels_do_not_show_is_less_certain():
    """A least-squares fit of many noisy phases, of which the first third weighs nothing."""
    t = np.linspace(0, DURATION_S, 6001)
    weights = np.where(t < DURATION_S / 3, 1e-3, 1.0)
    # the phase of the whole series, at d' = 1, from the noise of each of its samples
    noise = np.random.default_rng(1).standard_normal((4000, len(t))) / weights
    noise *= np.sqrt(np.sum(weights ** 2))
    first, last = 2 * np.pi * (t - t ** 2 / 2 / DURATION_S), np.pi * t ** 2 / DURATION_S
    basis = np.column_stack([np.ones_like(t), first, last]) * weights[:, None]
    found = np.linalg.lstsq(basis, (noise * weights).T, rcond=None)[0][1:]
    stds = stds_of_ends(weights, DURATION_S)
    assert stds == pytest.approx(found.std(axis=1), rel=0.05)
    assert stds[0] > 1.8 * stds[1]
