"""`ssi_ros info`: gaps by receipt and by header stamp are two things."""
import numpy as np

from ssi_ros.bag import open_bag, write_samples
from ssi_ros.bag.summary import as_text, summarise
from ssi_ros.records import Samples


def test_missing_samples_are_counted_by_their_stamps(tmp_path):
    """Three gaps of 1, 2 and 100 samples on one channel, none on the other."""
    values = np.zeros((3000, 2))
    for first, n in ((500, 1), (900, 2), (2000, 100)):
        values[first:first + n, 1] = np.nan
    write_samples(tmp_path / 'bag', Samples(values, 100.0, ('a', 'b'), 10 ** 18))
    summary = summarise(open_bag(tmp_path / 'bag'))
    a, b = summary['topics']
    assert (a['stamp_gaps'], a['stamps_missing']) == (0, 0)
    assert (b['stamp_gaps'], b['stamps_missing']) == (3, 103)
    assert b['messages'] == 2897 and b['gaps'] == 3        # logged as they were stamped
    lines = as_text(summary).splitlines()
    assert 'missing' not in lines[-2]
    assert '103 samples missing by their stamps, in 3 gaps' in lines[-1]
