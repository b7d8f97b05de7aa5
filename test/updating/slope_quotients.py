"""Slopes of spectra by errors of a model, held against difference quotients."""
import numpy as np

from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.hermitian import real_vectors, white
from ssi_ros.updating.slopes import plain_slopes, slopes


def assert_slopes_are_quotients(simulator, stds, text):
    """Hold the slopes by errors of deviations `stds` beside an effect, '' for none, to 1 %."""
    candidate = Candidate((parse_effect(text),) if text else ())
    base = simulator.expected(candidate)
    levels = np.linspace(0.7, 1.4, len(base.names))
    lower = np.linalg.inv(np.linalg.cholesky(base.at(levels)))
    rows = plain_slopes(simulator, levels, stds, candidate).whitened(lower[0])
    quotients = np.array([real_vectors(white(lower, change))[0] for change in slopes(
        simulator, base.at(levels), levels, stds, candidate)])
    # 1 %: a quotient over 1e-3 of a deviation, and single precision
    assert np.all(np.linalg.norm(rows - quotients, axis=1)
                  <= 0.01 * np.linalg.norm(quotients, axis=1) + 1e-4)
