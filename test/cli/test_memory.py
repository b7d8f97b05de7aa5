"""A command must not hand its memory back after every array, whoever started it."""
import os
import subprocess
import sys

import pytest

FAULTS = """
import resource, sys
import numpy as np
from ssi_ros.cli.main import main
if sys.argv[1] == 'verb':
    main(['effects'])
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(200):
    a = np.ones(2 ** 17)            # 1 MB: 256 pages, and no huge one
    del a
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(sys.platform != 'linux', reason='MALLOC_TRIM_THRESHOLD_ is of glibc')
def test_a_verb_keeps_what_it_frees_where_dask_said_otherwise():
    """Dask's threshold for its workers made a diagnosis three times as slow."""
    environment = {**os.environ, 'MALLOC_TRIM_THRESHOLD_': '65536'}
    torn, kept = (int(subprocess.run(
        [sys.executable, '-c', FAULTS, first], env=environment, capture_output=True, text=True,
        check=True).stdout.split()[-1]) for first in ('nothing', 'verb'))
    assert kept < 10 * 1024 < 50 * 1024 < torn
