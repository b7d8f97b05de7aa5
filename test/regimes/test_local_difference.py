"""What differs in few bands is no mean of all, (141a)."""
from types import SimpleNamespace

import numpy as np
import pytest

from ssi_ros.regimes.local_difference import local_difference

BANDS, WIDTH, COUNT = 400, 3, 30


def spectra(rng, gain=1.0, at=np.s_[:0]):
    """Return spectra of white noise of so many averages, some of the bands at another gain."""
    x = rng.standard_normal((BANDS, COUNT, WIDTH, 2)) @ [1, 1j] / np.sqrt(2)
    x[at, :, 1] *= gain
    mean = np.einsum('bni,bnj->bij', x, x.conj()) / COUNT
    return SimpleNamespace(mean=mean, freedom=float(COUNT),
                           cut=SimpleNamespace(bands=BANDS, middles_hz=np.arange(BANDS) / 10))


def found(record, one, turn=None, law=1.0):
    """Return the Detection between two of them."""
    recordings = SimpleNamespace(
        nominal=SimpleNamespace(trust=np.ones(BANDS), law=law), repeats=None, one=one, turn=turn,
        pair=SimpleNamespace(channels='abc'))
    prediction = SimpleNamespace(mean=one.mean, freedom=lambda n: np.full(BANDS, n))
    return local_difference(recordings, prediction, record)


def test_chance_alone_is_rarely_found():
    """p-values of spectra that do not differ are those of chance."""
    p_values = [found(*(spectra(np.random.default_rng([k, s])) for s in (0, 1))).p_value
                for k in range(40)]
    assert min(p_values) > 1e-3
    assert np.mean(np.array(p_values) < 0.05) < 0.15


@pytest.mark.parametrize('gain, change', [(1.8, '+4'), (0.5, '-6')])
def test_a_peak_in_eight_bands_is_placed(gain, change):
    """Of 400; a mean of all hardly shows it. The channel and how much it differs are said."""
    rng = np.random.default_rng(7)
    there = found(spectra(rng, gain, np.s_[200:208]), spectra(rng))
    assert there.p_value < 1e-9
    low, high = (float(there.text.split(w)[1].split()[0]) for w in ('from ', 'to '))
    assert low == pytest.approx(20.0, abs=0.4) and high == pytest.approx(20.7, abs=0.4)
    assert 'channel b' in there.text and f'({change}' in there.text


def test_a_difference_of_all_bands_is_not_local():
    """What all bands share is the gap itself; narrow stretches stand out of it or do not."""
    rng = np.random.default_rng(8)
    assert found(spectra(rng, 1.3, np.s_[:]), spectra(rng)).p_value > 1e-4


def test_levels_that_are_estimated_widen_chance():
    """Beside free levels a misfit of modes counts as scatter."""
    rng = np.random.default_rng(9)
    record, one = spectra(rng, 1.5, np.s_[100:108]), spectra(rng)
    assert found(record, one, law=3.0).p_value > 10 * found(record, one).p_value
