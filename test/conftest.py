"""What all tests share: loopback only, checked message fields, a seeded generator."""
import os
import pathlib

import numpy as np
import pytest

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'

BY_THE_CLOCK = ('ros', 'monitor', 'examples', 'test_launch.py', 'test_readme.py')
HERE = pathlib.Path(__file__).parent


def pytest_collection_modifyitems(items):
    """Mark what runs by the clock: `make test` lets it have the machine to itself."""
    for item in items:
        if item.path.relative_to(HERE).parts[0] in BY_THE_CLOCK:
            item.add_marker(pytest.mark.by_the_clock)


@pytest.fixture
def rng():
    """Return a generator with a fixed seed, so that a failure can be repeated."""
    return np.random.default_rng(20160627)
