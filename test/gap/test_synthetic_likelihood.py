"""Numbers that are known by simulation alone: right where their likelihood is known as well."""
import numpy as np
from ssi_ros.bootstrap.synthetic_likelihood import posterior

COUNT, RECORDS = 100, 40
MEANS, LOGS = np.linspace(-2.0, 3.0, 60), np.linspace(-1.5, 1.5, 50)


def test_mean_and_deviation_of_gaussian_samples():
    """Of a hundred samples: known to 0.1 and, its logarithm, to 0.07 of the deviation."""
    generator = np.random.default_rng(2)
    grid = np.stack(np.meshgrid(MEANS, LOGS, indexing='ij'), -1).reshape(-1, 2)

    def simulate(point):
        values = point[0] + np.exp(point[1]) * generator.standard_normal(COUNT)
        # the third says nothing: it must do no harm
        return np.array([values.mean(), np.log(values.std()), generator.standard_normal()])

    def every(points):
        return np.full(len(points), True)

    off, stds = [], []
    for _ in range(RECORDS):
        points, chances = posterior(simulate, simulate((0.4, 0.0)), grid, every, generator)
        mean = chances @ points
        stds.append(np.sqrt(chances @ (points - mean) ** 2))
        off.append((mean - (0.4, 0.0)) / stds[-1])
    # the scatter is one for all numbers: of the mean it is that of larger deviations as well
    ratio = np.mean(stds, axis=0) / (COUNT ** -0.5, (2 * COUNT) ** -0.5)
    assert np.all((ratio > 0.9) & (ratio < 1.6))
    # 3.5 deviations of a mean and of an rms of forty
    assert np.abs(np.mean(off, axis=0)).max() < 3.5 / np.sqrt(RECORDS)
    assert np.all(np.sqrt(np.mean(np.square(off), axis=0)) < 1.4)
