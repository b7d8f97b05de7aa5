"""Lowering the rate first is the filter of the bands, and leaves slow modes where they are."""
import numpy as np
import pytest
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import Identification, identify, Monitor
from ssi_ros.identify.bands import Thinner
from ssi_ros.records import Samples

NAMES = tuple('abcd')


@pytest.fixture(scope='module')
def values():
    """Return two minutes of four modes, two of them above the Nyquist frequency of 20 Hz."""
    return accelerations(PAIR_HZ, PAIR_SHAPES, 120.0, np.random.default_rng(5))


def test_same_filter_as_the_bands(values):
    """The rows that the first band keeps are those of a Thinner, to the last bit."""
    monitor = Monitor(NAMES, 100.0, 0, Identification(window_s=120.0, hop_s=10.0, decimation=5))
    monitor.push(values)
    thinned = Thinner(5, 4)
    hops = [thinned.push(values[k:k + 1000] - monitor.offset) for k in range(0, 12000, 1000)]
    np.testing.assert_array_equal(monitor.kept[0].rows, np.concatenate(hops))
    assert monitor.bands[0].rate_hz == 20.0


def test_slow_modes_stay_and_fast_ones_do_not_fold_back(values):
    """Modes of 6.4 Hz keep frequency and damping at 20 Hz; 15.8 Hz does not appear as 4.2 Hz."""
    found = [identify(Samples(values, 100.0, NAMES),
                      Identification(window_s=120.0, hop_s=10.0, decimation=d))[-1].modes
             for d in (1, 5)]
    assert all(abs(m.frequency_hz - PAIR_HZ[:2]).min() < 0.05 for m in found[1])
    for f in PAIR_HZ[:2]:
        a, b = (min(modes, key=lambda m: abs(m.frequency_hz - f)) for modes in found)
        # both see the same record, so they agree within three spreads of it
        assert abs(a.frequency_hz - b.frequency_hz) < 3.0 * a.frequency_std_hz
        assert abs(a.damping_ratio - b.damping_ratio) < 3.0 * a.damping_ratio_std


@pytest.mark.parametrize('given', [0, 101, 2.5])
def test_range(given):
    """Only whole factors of 1 to 100 are taken."""
    with pytest.raises(ValueError, match='decimation'):
        Identification(decimation=given)


def test_too_few_samples_are_told_at_the_lowered_rate():
    """The message counts samples after decimation."""
    with pytest.raises(ValueError, match='holds 120 samples at 1 Hz'):
        Monitor(('a',), 100.0, 0, Identification(window_s=120.0, hop_s=10.0, decimation=100))
