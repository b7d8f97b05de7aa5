"""Parts of arrays, without copies where there need be none."""
import numpy as np
import pytest
from ssi_ros.arrays import joined, marked_or_all, rising, shortened, written_out

WHOLE = np.arange(100.0)


@pytest.mark.parametrize('cuts', [(0, 10, 35, 90), (20, 21, 100), (5, 50)])
def test_neighbours_in_one_array_are_not_copied(cuts):
    """Also where they do not begin with it."""
    found = joined([WHOLE[a:b] for a, b in zip(cuts, cuts[1:])])
    assert np.array_equal(found, WHOLE[cuts[0]:cuts[-1]]) and np.shares_memory(found, WHOLE)


@pytest.mark.parametrize('pieces', [
    [WHOLE[:10], WHOLE[11:20]], [WHOLE[10:20], WHOLE[:10]], [WHOLE[:10:2], WHOLE[10:20]],
    [WHOLE[:10], WHOLE[10:20].copy()], [np.ones(3), np.zeros(2)]])
def test_all_others_are_joined(pieces):
    """With a gap, in another order, with steps, of another array."""
    assert np.array_equal(joined(pieces), np.concatenate(pieces))


def test_a_mask_of_all_is_a_slice():
    """So that what is taken by it is a view."""
    assert np.shares_memory(WHOLE[marked_or_all(WHOLE >= 0)], WHOLE)
    assert np.array_equal(WHOLE[marked_or_all(WHOLE > 97)], [98.0, 99.0])


@pytest.mark.parametrize('numbers', [
    [], [3], [3, 4, 5], [5, 4, 3], [3, 5, 6], [3, 3, 5], [3, 5, 5]])
def test_numbers_that_rise_by_one_are_a_range(numbers):
    """And no others; either way they are the same again."""
    found = shortened(np.array(numbers, np.int64))
    assert isinstance(found, range) == (numbers in ([3], [3, 4, 5]))
    assert written_out(found).tolist() == numbers


@pytest.mark.parametrize('numbers', [[], [1, 2, 2, 5], [2, 1, 2, 1]])
def test_what_does_not_fall_is_in_order(numbers):
    """Equal numbers stay in their order; nothing is copied where there is nothing to do."""
    numbers = np.array(numbers, float)
    found = numbers[rising(numbers)]
    assert found.tolist() == sorted(numbers)
    assert isinstance(rising(numbers), slice) is (numbers.tolist() == sorted(numbers))
