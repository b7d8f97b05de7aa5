"""What was lost or cut off is told from its neighbours, as far as the model knows."""
from dataclasses import replace

from gap_records import record
import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.holes import filled, LONGEST, without_rails


@pytest.fixture(scope='module')
def both():
    return record(120.0)


@pytest.fixture
def samples(both):
    return both[0]


@pytest.fixture
def simulator(both):
    return both[1]


def test_what_a_rail_cut_off_is_told_from_its_neighbours(samples, simulator):
    """Three parts in a thousand at the rails: half of the error of the clipped record is left."""
    limit = np.quantile(np.abs(samples.values), 0.997)
    clipped = replace(samples, values=np.clip(samples.values, -limit, limit))
    rails = [parse_effect(f'saturation:limit_m_s2={limit:.17g}')]
    whole = filled(simulator, without_rails(clipped, rails))
    cut = np.abs(clipped.values) >= limit
    assert np.array_equal(whole.values[~cut], clipped.values[~cut])
    left, lost = ((s.values - samples.values)[cut] for s in (whole, clipped))
    assert np.sqrt(np.mean(left ** 2)) < 0.5 * np.sqrt(np.mean(lost ** 2))


def test_what_cannot_be_told_is_left(samples, simulator):
    """Rails that half of the samples are at, and a hole too long, stay as they are."""
    limit = np.median(np.abs(samples.values))
    rails = [parse_effect(f'saturation:limit_m_s2={limit:.17g}')]
    assert without_rails(samples, rails) is samples
    assert without_rails(samples, []) is samples
    values = samples.values.copy()
    values[1000:1001 + LONGEST], values[5000] = np.nan, np.nan
    whole = filled(simulator, replace(samples, values=values))
    assert np.isnan(whole.values[1000:1001 + LONGEST]).all()
    assert np.isfinite(whole.values[5000]).all()
