"""A mode that is lost because nothing excites it is reported as that."""
import numpy as np
from simple_structure import accelerations, PAIR_SHAPES
from ssi_ros.identify import Identification, identify, Monitor
from ssi_ros.identify.excitation import part_powers, unevenness
from ssi_ros.identify.window import Window
from ssi_ros.records import Samples

NAMES = tuple('abcd')
SETTINGS = Identification(window_s=40.0, hop_s=10.0)


def record(seconds, seed=4):
    """Return a loud mode of 9 Hz."""
    return accelerations([9.0], PAIR_SHAPES[:1], seconds, np.random.default_rng(seed), noise=0.01)


def test_an_excitation_that_stops_is_named():
    """After 60 s only the noise is left: the mode goes, the window says why, until it returns."""
    values = np.concatenate([record(60.0), 0.01 * np.random.default_rng(1).standard_normal(
        (8000, 4)), record(60.0, 5)])
    windows = identify(Samples(values, 100.0, NAMES), SETTINGS)
    first = windows[0].modes[0]
    quiet = [w for w in windows if w.start_ns >= 60e9 and w.end_ns <= 140e9]
    assert quiet
    for w in quiet:
        assert f'mode {first.identity} (9.' in w.reason and 'excitation stopped' in w.reason
        assert first.identity not in [m.identity for m in w.modes]
    assert not windows[0].reason and 'stopped' not in windows[-1].reason
    # the identity outlives the silence
    assert first.identity in [m.identity for m in windows[-1].modes]


def test_a_mode_that_changes_is_not_blamed_on_the_excitation():
    """The frequency jumps while the force goes on: no word of an excitation that stopped."""
    rng = np.random.default_rng(6)
    values = np.concatenate([record(60.0), accelerations([11.0], PAIR_SHAPES[:1], 60.0, rng,
                                                         noise=0.01)])
    for w in identify(Samples(values, 100.0, NAMES), SETTINGS):
        assert 'stopped' not in w.reason


def powers(pieces):
    """Return the powers of the parts of a window of pieces of two channels."""
    window = Window(len(pieces), 2)
    for rows in [np.ones((7, 2)), *pieces]:         # the first one is forgotten again
        window.push(rows)
    np.testing.assert_array_equal(window.rows, np.concatenate(pieces))
    return part_powers(window.powers, 2)


def test_an_uneven_window_is_told():
    """A burst in one quarter makes the window uneven; white noise does not."""
    rng = np.random.default_rng(3)
    rows = [rng.standard_normal((100, 2)) for _ in range(40)]
    assert unevenness(powers(rows)) == ''
    rows[5:8] = [30.0 * r for r in rows[5:8]]
    assert 'not stationary' in unevenness(powers(rows))
    # a part without samples says nothing
    assert np.isnan(powers([np.full((5, 2), np.nan)] * 4)).all()


def test_asking_does_not_remember():
    """`identify_now` leaves what is remembered as it was."""
    monitor = Monitor(NAMES, 100.0, 0, SETTINGS)
    monitor.push(record(45.0))
    before = dict(monitor.heard)
    monitor.identify_now()
    assert before and monitor.heard == before
