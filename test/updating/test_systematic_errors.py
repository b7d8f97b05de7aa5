"""Intervals hold what filled rows take from a size, and what a law of a hinge is off by."""
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.comparison import Fit
from ssi_ros.records import Samples
from ssi_ros.updating.systematic_errors import filled_share, wider


def test_the_share_is_that_of_filled_rows_among_those_that_are_used():
    """Not of longer gaps, which are left out."""
    before, after = np.zeros((2, 100, 1))
    before[10:20] = before[50:90] = np.nan
    after[50:90] = np.nan
    samples, raw = (Samples(v, 10.0, ('a',)) for v in (after, before))
    assert filled_share(SimpleNamespace(samples=samples, raw=(raw, None))) == pytest.approx(1 / 6)
    assert filled_share(SimpleNamespace(samples=samples, raw=())) == 0.0


@pytest.mark.parametrize('text, bias', [
    ('sensor_gain:channel=e1_a,scale=1.05', [0.05]),        # of what it differs from 1
    ('clock_rate:ppm=300', [300.0]),
    # the logarithm of a size of the power -1
    ('hinge_compliance:array=E1,stiffness_n_m_rad=1e5', [1.0])])
def test_a_size_is_known_to_its_share_of_filled_rows(text, bias):
    """Nothing but sizes is wider."""
    candidate = Candidate((parse_effect(text),))
    count = len(candidate.point())
    fit = Fit(candidate, np.zeros(count), np.diag(np.full(count, 1e-6)), 0.0, np.ones(2))
    more = np.sqrt(np.diag(wider(fit, 0.1, 0.0).covariance) - 1e-6) / 0.1
    assert more == pytest.approx(bias, rel=1e-3, abs=1e-6)


def test_a_law_of_a_hinge_is_off_in_all_its_numbers():
    """Its size and its stiffness, the former by filled rows, too; a linear hinge is exact."""
    candidate = Candidate((parse_effect(
        'hinge_friction:array=E1,torque_n_m=0.01,stiffness_n_m_rad=1e5'),))
    fit = Fit(candidate, np.zeros(2), np.diag([1e-6, 1e-6]), 0.0, np.ones(2))
    found = np.diag(wider(fit, 0.1, 0.2).covariance) - 1e-6
    assert found == pytest.approx([0.2 ** 2 + 0.1 ** 2, 0.2 ** 2])
