"""What all tests share: loopback only, checked message fields, a seeded generator."""
import os

import numpy as np
import pytest

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'


@pytest.fixture
def rng():
    """Return a generator with a fixed seed, so that a failure can be repeated."""
    return np.random.default_rng(20160627)
