"""Straight tracks: found where they are, by the same search as trying each of them."""
import numpy as np
import pytest
from ssi_ros.events.track import best_lines, cells, LOUD, straight


def test_the_best_line_is_that_of_trying_all():
    """Forty pieces of sixty bins: the sum and the first bin that the slow way finds."""
    rng = np.random.default_rng(1)
    power = rng.exponential(size=(40, 60)).astype(np.float32)
    shifts = np.rint(np.outer([-70, -31, 0, 12], np.linspace(0, 1, 40))).astype(np.int64)
    tops, starts = best_lines(power, shifts, 5, 55)
    assert starts[0] == -1          # 70 bins do not fit between 50
    for k in (1, 2, 3):
        sums = {b: power[np.arange(40), b + shifts[k]].sum() for b in range(5, 55)
                if 5 <= (b + shifts[k]).min() and (b + shifts[k]).max() < 55}
        assert starts[k] == max(sums, key=sums.get)
        assert tops[k] == pytest.approx(max(sums.values()), rel=1e-5)     # single precision


@pytest.mark.parametrize('ends_hz', [(3.0, 8.0), (7.0, 2.0)])
def test_a_moving_line_is_followed_and_knocks_are_not(ends_hz):
    """A tenth of the power, up and down, under white noise with knocks of a hundred times."""
    rng = np.random.default_rng(2)
    t = np.arange(20_000) / 25.0
    phase = 2 * np.pi * (ends_hz[0] * t + (ends_hz[1] - ends_hz[0]) * t ** 2 / (2 * t[-1]))
    values = rng.standard_normal((len(t), 2)) + 0.45 * np.sin(phase)[:, None]
    values[rng.integers(0, len(t), 20)] *= 10.0
    rows = 200
    powers = cells(values, rows)
    assert powers.max() < 2 * LOUD
    track = straight(powers, 4, powers.shape[1])
    # a bin of a piece
    assert track.start * 25.0 / rows == pytest.approx(ends_hz[0], abs=25.0 / rows)
    assert track.end * 25.0 / rows == pytest.approx(ends_hz[1], abs=25.0 / rows)
    assert straight(powers, 2 * powers.shape[1], 3 * powers.shape[1]) is None
