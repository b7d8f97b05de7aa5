"""Arrays of all parts of a record as sums of a few."""
import numpy as np
import pytest
from ssi_ros.weighted_sums import changed, each_of, interpolated, mean_of, total_of, WeightedSum

RNG = np.random.default_rng(1)
FEW = RNG.standard_normal((3, 4, 2)) + 1j * RNG.standard_normal((3, 4, 2))
WEIGHTS = RNG.standard_normal((7, 3))
EACH = np.einsum('an,nkl->akl', WEIGHTS, FEW)
STEADY = RNG.standard_normal((1, 4, 2)) + 0j


def test_each_and_mean_are_those_of_all_parts():
    """Weights times the few; what is no WeightedSum stays as it is."""
    assert WeightedSum(FEW, WEIGHTS).each == pytest.approx(EACH)
    assert WeightedSum(FEW.real, WEIGHTS).each == pytest.approx(np.einsum(
        'an,nkl->akl', WEIGHTS, FEW.real))
    assert mean_of(WeightedSum(FEW, WEIGHTS)) == pytest.approx(EACH.mean(axis=0))
    assert each_of(STEADY) is STEADY and mean_of(EACH) == pytest.approx(EACH.mean(axis=0))


@pytest.mark.parametrize('others', [[], [STEADY], [STEADY, -3 * STEADY], [EACH]])
def test_total_is_the_sum_of_all(others):
    """Steady arrays are the same in every part; one of all parts makes the sum one."""
    found = total_of([WeightedSum(FEW, WEIGHTS), *others,
                      WeightedSum(-2 * FEW[:1], WEIGHTS[:, 1:2])])
    expected = EACH - 2 * WEIGHTS[:, 1, None, None] * FEW[0] + sum(others)
    assert each_of(found) == pytest.approx(expected)


def test_linear_functions_are_of_the_few():
    """A change of a WeightedSum is that of every part."""
    found = changed(WeightedSum(FEW, WEIGHTS), lambda x: 2j * x)
    assert len(found.few) == 3 and found.each == pytest.approx(2j * EACH)


def test_interpolation_weighs_what_varies_already():
    """Of nodes that are WeightedSum, of all parts, or steady."""
    nodes = RNG.standard_normal((7, 2))
    assert each_of(interpolated(nodes, [STEADY, EACH])) == pytest.approx(
        nodes[:, 0, None, None] * STEADY + nodes[:, 1, None, None] * EACH)
    assert interpolated(nodes, [WeightedSum(FEW, WEIGHTS), STEADY]).each == pytest.approx(
        nodes[:, 0, None, None] * EACH + nodes[:, 1, None, None] * STEADY)
