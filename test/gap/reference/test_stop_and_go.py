"""Forces that stop and go are a level that varies, not pulses, (161)."""
import numpy as np
from ssi_ros.gap.nominal.stationary.impulses import pulses


def test_motion_that_begins_and_ends_at_once_has_no_pulses():
    """Blocks of 1500 samples at 1 and 0.3 of the level; 24,000 samples of four channels."""
    rng = np.random.default_rng(5)
    one, two = rng.standard_normal((2, 24_000, 4))
    going = np.where(np.arange(24_000) // 1500 % 2, 0.3, 1.0)[:, None]
    assert pulses(one, going * two) is None
    struck = going * two
    struck[400::1500] += 3.0
    assert pulses(one, struck)[1] >= 15
