"""What the unknown errors of a calibrated model may add to the statistics of the live meter."""
import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.hermitian import inverse_root, real_vectors
from ssi_ros.updating.prior import error_directions, known_by_recordings

FARTHEST = 4.0      # deviations: of a hundred statistics one is farther in 200 calibrations


def largest_bias(model):
    """
    Return how far the mean of each statistic may be from zero where nothing has changed.

    A live stream has no end: the smallest error that a calibration has left would be an alarm some
    day, were it not allowed for. Of errors theta with the covariance A A^T of the calibration the
    statistic t of a hop has the mean t^T V A u, with u of unit variance and V as in eq. (116).

    Parameters
    ----------
    model : LiveModel
        Of the live meter, its bank not made yet.

    Returns
    -------
    ndarray, (t,)
        Of templates, in standard deviations of a statistic of one hop.
    ndarray, (k,)
        Of the power of a line in every bin, over the expected one.

    Both are zero for a model without a calibration.

    """
    simulator, templates, line = model.simulator, model.templates, model.line
    calibration = simulator.spacecraft.calibration
    if not calibration.covariance:
        return np.zeros(len(templates)), np.zeros(len(line))
    expected = simulator.expected(Candidate())
    levels = np.ones(len(expected.names))
    errors = error_directions(simulator, levels, known_by_recordings(calibration)).vectors
    means = templates @ errors.T
    aim = np.einsum('kij,kj->ki', inverse_root(expected.at_nominal)[0], line)
    aim /= np.linalg.norm(aim, axis=1)[:, None]
    along = real_vectors(aim[:, :, None] * aim.conj()[:, None, :]).reshape(len(line), -1)
    powers = np.einsum('nkd,kd->kn', errors.reshape(len(errors), *along.shape), along)
    return (FARTHEST * np.linalg.norm(means, axis=1) / np.sqrt(model.frame.inflation),
            FARTHEST * np.linalg.norm(powers, axis=1))


def bet_beside(bias, tilt, price):
    """Return the bet on an exponential variable, less 1, whose mean may be larger by a bias."""
    # on the variable over its largest mean, so that it wins nothing there either
    less = tilt / (1 + bias)
    return less, price + tilt - less
