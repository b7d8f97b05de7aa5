"""Two parts alike whose close modes mix where one of them changes."""
import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter
from ssi_ros.gap.nominal.forms.mode_coupling import close_pairs, mixed_modes
from ssi_ros.gap.nominal.forms.structure import frequencies
from ssi_ros.gap.nominal.modal.fit import fit
from ssi_ros.gap.nominal.modal.prediction import Averages
from ssi_ros.gap.nominal.modal.reference import identified, make_nominal, modes_of
from ssi_ros.gap.spectra.band_averages import plan, spectra_of
from ssi_ros.records import Samples

RATE_HZ = 50.0
SOFTER = 0.96


def twins(seed, second=1.0, seconds=800.0):
    """Return accelerations of two parts of 5 Hz, weakly tied, each under its own white force."""
    rng = np.random.default_rng(seed)
    stiffness = (2 * np.pi * 5.0) ** 2 * np.array([[1.005, -0.005], [-0.005, second + 0.005]])
    sizes, shapes = np.linalg.eigh(stiffness)
    rows = int(seconds * RATE_HZ)
    forces = shapes.T @ rng.standard_normal((2, rows + 1000))
    modal = []
    for w, force in zip(np.sqrt(sizes), forces):
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * 0.008 * w, w ** 2]), 1 / RATE_HZ)
        modal.append(lfilter(np.ravel(b), a, force)[1000:])
    values = np.array(modal).T @ shapes.T
    return Samples(values + 0.01 * rng.standard_normal(values.shape), RATE_HZ, ('a', 'b'))


@pytest.fixture(scope='module')
def pair():
    """Return the nominal of twins, both spectra, and the modes where the second is softer."""
    one, two = twins(1), twins(2, SOFTER)
    cut = plan(len(one.values), RATE_HZ, 2)
    first, second = spectra_of(one.values, cut), spectra_of(two.values, cut)
    nominal = make_nominal(one.values, one.channels, cut, first.mean)
    return nominal, first, second, modes_of(
        nominal, identified(two.values, two.channels, RATE_HZ))


def test_close_modes_are_a_pair_and_nothing_changes_at_null(pair):
    """Both modes of the twins pair up; all numbers null are no filter."""
    nominal, _, _, there = pair
    assert close_pairs(nominal.modes) == [(0, 1)]
    form = mixed_modes(nominal, there)
    gain, added = form.change(nominal, np.zeros(len(form.numbers)))
    assert added is None
    np.testing.assert_allclose(gain, np.broadcast_to(np.eye(2), gain.shape), atol=1e-6)


def test_a_softer_twin_is_two_modes_mixed_and_not_two_modes_moved(pair):
    """The mixed form tells the softening and gains more than modes moved each on its own."""
    nominal, one, two, there = pair
    record = Averages(two.mean, one.freedom, two.freedom)
    base = fit(nominal, record)
    each = [f for f in frequencies(nominal) if len(f.numbers) > 1][0]
    mixed = mixed_modes(nominal, there)
    moved, turned = (fit(nominal, record, (f,), np.append(base.x, f.start), origin=base.x)
                     for f in (each, mixed))
    assert turned.likelihood > moved.likelihood + 40
    x = turned.x[2:]
    f0 = nominal.modes.frequencies_hz
    stiffness = np.array([[np.exp(x[0]), x[2]], [x[2], np.exp(x[1])]]) * np.outer(f0, f0)
    change = np.linalg.eigvalsh(stiffness).min() / f0.min() ** 2
    assert change == pytest.approx(SOFTER + 0.005, abs=0.006)
    # and a twin that did not change is not found to have done so
    still = spectra_of(twins(3).values, nominal.cut)
    still = Averages(still.mean, one.freedom, still.freedom)
    same = fit(nominal, still, (mixed,), np.append(base.x, mixed.start),
               origin=fit(nominal, still).x)
    assert np.abs(same.x[2:5]).max() < 0.01
