"""How errors of a model differ from one healthy recording to the next."""
import numpy as np
import pytest
from scipy.stats import chi2
from ssi_ros.updating.scatter import between_recordings, common_variance

NAMES = [f'frequency E{array} {mode}' for array in (1, 2) for mode in (1, 2, 3)]
CHANCE = np.array([0.3, 0.06, 0.045] * 2) ** 2


def outside(apart, recordings, rng, repeats=400):
    """Return how often the next recording is off by more than a chance of 5 %."""
    off = []
    for _ in range(repeats):
        fits = rng.standard_normal((recordings + 1, 6)) * np.sqrt(CHANCE + apart ** 2)
        past, following = fits[:-1], fits[-1]
        found = between_recordings(NAMES, past.var(axis=0, ddof=1), CHANCE, recordings)
        variance = CHANCE * (1 + 1 / recordings) + found ** 2 * (1 + 1 / recordings)
        off.append(np.sum((following - past.mean(axis=0)) ** 2 / variance))
    return np.mean(np.array(off) > chi2.isf(0.05, 6))


@pytest.mark.parametrize('recordings, apart, most', [
    (2, 0.0, 0.08), (3, 0.0, 0.08), (2, 0.02, 0.09), (3, 0.05, 0.17), (2, 0.15, 0.27)])
def test_the_next_recording_is_as_far_as_is_said(recordings, apart, most, rng):
    """Nearly: two recordings of six frequencies say little of what differs; 0.54 before."""
    assert outside(apart, recordings, rng) < most


def test_one_loose_mode_has_a_scatter_of_its_own():
    """Others of its kind share what they have, and another kind has nothing of it."""
    names, chance = [*NAMES, 'damping E1 1'], np.append(CHANCE, 0.04)
    spread = chance.copy()
    spread[1] = 400 * chance[1]
    found = between_recordings(names, spread, chance, 4)
    assert found[1] == pytest.approx(np.sqrt(399 * chance[1])) and found[-1] == 0.0
    assert np.ptp(found[[0, 2, 3, 4, 5]]) == 0.0 < found[1]


def test_a_common_variance_is_beside_chance():
    """That of twice the chance alone is the chance again; less than chance is none."""
    assert common_variance(2 * np.ones(5), np.ones(5)) == pytest.approx(1.0)
    assert common_variance(0.9 * np.ones(5), np.ones(5)) == 0.0
