"""Channels of a bag, brought onto one grid."""
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.report.samples import samples_of


def recording(stamps_s, channels=1):
    """Return a recording of channels with the same stamps."""
    stamps = np.round(1e9 * np.asarray(stamps_s)).astype(np.int64)
    return SimpleNamespace(names=tuple('abc'[:channels]), stamps_ns=[stamps] * channels,
                           arrivals_ns=[np.sort(stamps)] * channels,
                           values=[np.ones(len(stamps))] * channels)


def test_half_an_hour_is_no_jump_of_the_clock():
    """Channels of a long record are read side by side, not one after the other."""
    samples = samples_of(recording(np.arange(0.0, 1800.0, 0.05), 3), 20.0)
    assert samples.values.shape == (36_000, 3) and np.all(samples.values == 1.0)


@pytest.mark.parametrize('own_hz', [50.0, 200.0])
def test_another_rate_is_told(own_hz):
    """Half of a grid empty, or two samples for a place, is a wrong rate and not a bad record."""
    with pytest.raises(ValueError, match=f'comes at {own_hz:g} Hz, not at the 100 Hz'):
        samples_of(recording(np.arange(1000) / own_hz), 100.0)


def test_losses_and_jitter_are_no_other_rate():
    """Nine samples of ten lost, and stamps off by a fifth of a step, keep the rate."""
    rng = np.random.default_rng(1)
    t = (np.arange(5000) + rng.uniform(-0.2, 0.2, 5000)) / 100.0
    assert len(samples_of(recording(t), 100.0).values) == 5000
    kept = samples_of(recording(t[np.sort(rng.choice(5000, 500, replace=False))]), 100.0).values
    assert np.isnan(kept).mean() == pytest.approx(0.9, abs=0.01)    # but for the two ends
