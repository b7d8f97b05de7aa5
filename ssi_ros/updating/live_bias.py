"""What the unknown errors of a calibrated model may add to the statistics of the live meter."""
import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.updating.prior import error_directions, known_by_recordings

FARTHEST = 4.0      # deviations: of a hundred statistics one is farther in 200 calibrations


def largest_bias(simulator, templates, inflation):
    """
    Return how far the mean of each statistic may be from zero where nothing has changed, (t,).

    A live stream has no end: the smallest error that a calibration has left would be an alarm some
    day, were it not allowed for. Of errors theta with the covariance A A^T of the calibration the
    statistic t of a hop has the mean t^T V A u, with u of unit variance and V as in eq. (116).

    Parameters
    ----------
    simulator : Simulator
        Of one hop.
    templates : ndarray, (t, k l l)
        Whitened directions of norm 1.
    inflation : float
        Variance of their products with the spectrum of a hop.

    Returns
    -------
    ndarray, (t,)
        In standard deviations of a statistic of one hop; zero for a model without a calibration.

    """
    calibration = simulator.spacecraft.calibration
    if not calibration.covariance:
        return np.zeros(len(templates))
    levels = np.ones(len(simulator.expected(Candidate()).names))
    errors = error_directions(simulator, levels, known_by_recordings(calibration))
    means = templates @ errors.vectors.T.astype(np.float32)
    return FARTHEST * np.linalg.norm(means, axis=1) / np.sqrt(inflation)
