"""What all tests share: loopback only, checked message fields, a seeded generator."""
import os
import pathlib

import numpy as np
import pytest

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'

BY_THE_CLOCK = ('ros', 'monitor', 'examples', 'test_launch.py', 'test_readme.py')
HERE = pathlib.Path(__file__).parent


def pytest_collection_modifyitems(items):
    """Give each file to one worker, and to one alone all that runs by the clock, first of all."""
    def by_the_clock(item):
        return item.path.relative_to(HERE).parts[0] in BY_THE_CLOCK

    for item in items:
        group = 'clock' if by_the_clock(item) else str(item.path)
        item.add_marker(pytest.mark.xdist_group(group))
    items.sort(key=by_the_clock, reverse=True)


@pytest.fixture
def rng():
    """Return a generator with a fixed seed, so that a failure can be repeated."""
    return np.random.default_rng(20160627)
