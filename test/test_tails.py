"""Tail probabilities against those of scipy.stats."""
import numpy as np
import pytest
from scipy import stats
from ssi_ros.tails import chi2, fisher, gamma, norm, student

X = np.array([-3.0, 0.0, 1e-3, 0.7, 4.0, 30.0])
P = np.array([1e-12, 0.01, 0.5, 0.99])


@pytest.mark.parametrize('own, other, values', [
    (norm.sf, stats.norm.sf, (X,)), (norm.logsf, stats.norm.logsf, (X,)),
    (norm.isf, stats.norm.isf, (P,)), (norm.pdf, stats.norm.pdf, (X, 0.4, 2.0)),
    (chi2.sf, stats.chi2.sf, (X, 3)), (chi2.sf, stats.chi2.sf, (X[2:], 0)),
    (chi2.isf, stats.chi2.isf, (P, 3)),
    (gamma.sf, lambda x, a: stats.gamma.sf(x, a, scale=1.0), (X, 2.5)),
    (lambda x, a: gamma.sf(x, a, scale=3.0), lambda x, a: stats.gamma.sf(x, a, scale=3.0),
     (X, 2.5)),
    (gamma.logsf, stats.gamma.logsf, (X, 2.5)), (student.sf, stats.t.sf, (X, 5)),
    (fisher.sf, stats.f.sf, (X[1:], 2, 7)), (fisher.isf, stats.f.isf, (P, 2, 7))])
def test_tails_are_those_of_scipy_stats(own, other, values):
    """To the last digits, beyond the support as well."""
    assert own(*values) == pytest.approx(other(*values), rel=1e-13, abs=1e-15, nan_ok=True)
