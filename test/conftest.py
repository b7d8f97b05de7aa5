"""What all tests share: loopback only, checked message fields, a seeded generator."""
from itertools import count
import os
import pathlib
import re

import numpy as np
import pytest

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'

BY_THE_CLOCK = ('ros', 'monitor', 'examples', 'test_launch.py',
                'test_launch_runs.py', 'test_readme.py')
HERE = pathlib.Path(__file__).parent
WORKER = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0')[2:])
WORKERS = int(os.environ.get('PYTEST_XDIST_WORKER_COUNT', '1'))
# one process draws the first domain, so that workers side by side never share one
FIRST_DOMAIN = int(os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getppid() % 100)))
DOMAINS = 100 // WORKERS        # of each worker
TESTS = count()


def by_the_clock(path):
    """Return whether a file or folder below this one holds what runs by the clock."""
    return path.relative_to(HERE).parts[0] in BY_THE_CLOCK


def pytest_ignore_collect(collection_path, config):
    """Import no file of which `-m` leaves nothing: every worker imports all that is collected."""
    chosen = re.match('(not )?by_the_clock and ', config.option.markexpr)
    if chosen and collection_path != HERE and HERE in collection_path.parents:
        return True if by_the_clock(collection_path) == bool(chosen[1]) else None
    return None


def pytest_collection_modifyitems(items):
    """Mark what runs by the clock: `make test` computes nothing beside it."""
    for item in items:
        if by_the_clock(item.path):
            item.add_marker(pytest.mark.by_the_clock)


@pytest.fixture(autouse=True)
def own_domain(request):
    """Nodes that the test before has killed stay in the graph of their domain for 20 s."""
    if request.node.get_closest_marker('by_the_clock'):
        own = WORKER * DOMAINS + next(TESTS) % DOMAINS      # that no other worker ever draws
        os.environ['ROS_DOMAIN_ID'] = str(1 + (FIRST_DOMAIN + own) % 100)


@pytest.fixture
def rng():
    """Return a generator with a fixed seed, so that a failure can be repeated."""
    return np.random.default_rng(20160627)
