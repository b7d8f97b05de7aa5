"""Table 1 by a plain SSI-COV that shares no code with the package."""
import numpy as np
import pytest
from ssi_ros.model import simulate
from ssi_ros.model.three_dof import excitation_of, LINE_HZ, three_dof

PUBLISHED_HZ = [7.0831, 19.8462, 28.6787]       # paper, section 5.1


def ssi_cov(values, rate_hz, rows, order):
    """Return frequencies [Hz] and damping ratios by SSI-COV as in the paper, eq. (18) to (30)."""
    n, width = values.shape
    lags = [values[k:].T @ values[:n - k] / (n - k) for k in range(2 * rows + 1)]

    def toeplitz(shift):
        return np.block([[lags[rows + p - q + shift] for q in range(rows)] for p in range(rows)])
    u, s, vt = np.linalg.svd(toeplitz(0))
    root = np.sqrt(s[:order])
    a = (u[:, :order] / root).T @ toeplitz(1) @ (vt[:order].T / root)
    poles = np.log(np.linalg.eigvals(a).astype(complex)) * rate_hz
    poles = poles[poles.imag > 0]
    return np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)


@pytest.mark.parametrize('case, duration_s, line', [
    ('white', 600.0, False), ('white_and_sine', 600.0, True), ('sine', 20.0, True)])
def test_table_1(case, duration_s, line):
    """All three within 0.3 % (4 spreads of mode 1), and 12 Hz undamped where it acts."""
    samples = simulate(three_dof(), duration_s, 1, excitation=excitation_of(case), at_rest=True)
    frequencies, ratios = ssi_cov(samples.values, 100.0, 50, 16)
    for published in PUBLISHED_HZ:
        assert np.min(np.abs(frequencies / published - 1)) < 3e-3
    near = np.abs(frequencies / LINE_HZ - 1) < 1e-3
    assert near.any() == line
    if line:
        assert np.min(np.abs(ratios[near])) < 5e-4        # a tenth of the modes' own


def test_a_pure_sine_in_its_steady_state_shows_no_mode():
    """Without the transient only 12 Hz is left: the record is one line, to the noise."""
    samples = simulate(three_dof(), 60.0, 1, excitation=excitation_of('sine'))
    t = np.arange(len(samples.values)) / 100.0
    basis = np.column_stack([np.sin(2 * np.pi * LINE_HZ * t), np.cos(2 * np.pi * LINE_HZ * t)])
    left = samples.values - basis @ np.linalg.lstsq(basis, samples.values, rcond=None)[0]
    assert left.std() == pytest.approx(1e-6, rel=0.05)    # the sensor's noise, 3 standard errors


def test_unknown_case_is_refused():
    """The message lists the cases."""
    with pytest.raises(ValueError, match='white, white_and_sine, sine'):
        excitation_of('pink')
