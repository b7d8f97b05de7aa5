"""Laws of the parts: what is brought together, the floor, the modal forms, the amplitude."""
import numpy as np
import pytest
from reference_records import chain, RATE_HZ
from ssi_ros.gap.inference.goodness_of_fit import compare, divergence, floor_of_band
from ssi_ros.gap.nominal.modal.amplitude_dependence import amplitude_dependence
from ssi_ros.gap.nominal.modal.fit import fit
from ssi_ros.gap.nominal.modal.mixed_halves import floor_of_halves
from ssi_ros.gap.nominal.modal.prediction import Averages, predict
from ssi_ros.gap.nominal.modal.reference import make_nominal
from ssi_ros.gap.nominal.modal.starting_values import all_forms
from ssi_ros.gap.nominal.pairing import make_pair
from ssi_ros.gap.spectra.band_averages import plan, spectra_of
from ssi_ros.integrity.values import limit_of, step_of
from ssi_ros.records import Samples


def parts(one, two):
    cut = plan(min(len(one.values), len(two.values)), one.rate_hz, one.values.shape[1])
    first, second = spectra_of(one.values, cut), spectra_of(two.values, cut)
    return first, second, make_nominal(one.values, one.channels, cut, first.mean)


def test_no_channel_in_common_is_refused():
    """The message lists both sets and what to do."""
    one = chain(1, 30.0)
    with pytest.raises(ValueError, match='none is in both'):
        make_pair(one, Samples(one.values, RATE_HZ, ('x', 'y', 'z')))


def test_a_rate_in_a_simple_ratio_is_brought_down_and_another_is_refused():
    """Twice the rate works, and says so; an odd ratio is refused."""
    rng = np.random.default_rng(2)
    slow = Samples(rng.standard_normal((500, 1)), 50.0, ('a',))
    fast = Samples(rng.standard_normal((1000, 1)), 100.0, ('a',))
    pair = make_pair(slow, fast)
    assert pair.rate_hz == 50.0
    assert len(pair.record) == 500
    assert 'brought to 50 Hz' in pair.notes[0]
    with pytest.raises(ValueError, match='no ratio of whole numbers'):
        make_pair(slow, Samples(fast.values, 50.0 * 71 / 67, ('a',)))


def test_a_dead_or_missing_channel_is_left_out_and_told():
    """The others are still compared, and the answer is called partial."""
    one, two = chain(1, 30.0), chain(2, 30.0, channels=2)
    dead = two.values.copy()
    dead[:, 1] = 3.0
    pair = make_pair(one, Samples(dead, RATE_HZ, two.channels))
    assert pair.channels == ('a',)
    assert sum('partial' in n for n in pair.notes) == 2


def test_the_floor_is_that_of_complex_wishart_matrices():
    """Theory (142) against 400 draws."""
    rng = np.random.default_rng(3)
    n_one, n_two, width = 24, 40, 3

    def draw(n):
        y = rng.standard_normal((400, n, width)) + 1j * rng.standard_normal((400, n, width))
        return y.swapaxes(1, 2) @ y.conj() / n
    found = divergence(draw(n_one), draw(n_two), n_one, n_two)
    mean, std = floor_of_band(n_two, width, n_one)
    # 4 standard errors of the mean of 400; 15 % for their scatter
    assert abs(found.mean() - mean) < 4 * found.std() / 20
    assert std == pytest.approx(found.std(), rel=0.15)


def test_a_known_spectrum_is_the_limit_of_one_averaged_without_end():
    """Distance and floor of n = 1e7 approach those of n = inf as 1 / n; 1e-4 for the former."""
    rng = np.random.default_rng(5)
    y = rng.standard_normal((2, 30, 3)) + 1j * rng.standard_normal((2, 30, 3))
    expected, observed = y.swapaxes(1, 2) @ y.conj() / 30
    near, limit = (divergence(expected, observed, n, 30.0) for n in (1e7, np.inf))
    assert near == pytest.approx(limit, rel=1e-4)
    (near, _), (limit, _) = (floor_of_band(30.0, 3, n) for n in (1e7, np.inf))
    assert near == pytest.approx(limit, rel=1e-4)


def test_the_distance_does_not_depend_on_units_or_mixtures():
    """D(M A M^H, M B M^H) = D(A, B) for any invertible M."""
    first, second, _ = parts(chain(4, 60.0), chain(5, 60.0))
    mix = np.random.default_rng(6).standard_normal((3, 3))
    a, b = (s.mean for s in (first, second))
    # 1e-8: only round-off parts them
    assert np.allclose(divergence(a, b, 20, 30), divergence(
        mix @ a @ mix.T, mix @ b @ mix.T, 20, 30), atol=1e-8)


def test_the_floor_of_the_data_agrees_with_theory_for_gaussian_noise():
    """Mixed halves of white noise: within 5 %, which is 3 sd of their own scatter."""
    rng = np.random.default_rng(7)
    one, two = (Samples(rng.standard_normal((10_000, 2)), 50.0, ('a', 'b')) for _ in range(2))
    first, second, _ = parts(one, two)
    gap = compare(first, second)
    assert floor_of_halves(first, second)[0] == pytest.approx(gap.floor, rel=0.05)
    assert abs(gap.deviations) < 4


def test_every_form_is_null_at_zero_and_at_its_start_is_not():
    """One law for all forms: x = 0 changes nothing."""
    first, second, nominal = parts(chain(8), chain(9))
    forms = all_forms(nominal)
    assert {f.effect for f in forms} >= {
        'excitation_colour', 'sensor_gain', 'sensor_crosstalk', 'channel_delay',
        'sensor_bandwidth', 'sensor_noise', 'sensor_drift', 'timestamp_jitter',
        'stiffness_scale', 'damping_scale'}
    for form in forms:
        numbers = len(form.numbers)
        null = predict(nominal, (form,), np.zeros(2 + numbers))
        # 1e-12: round-off of a filter that is the identity
        assert np.allclose(null.mean, first.mean, rtol=1e-12), form.effect
        assert np.allclose(null.scatters, first.mean, rtol=1e-12), form.effect
        start = predict(nominal, (form,), np.array([0.0, 0.0] + [n.start for n in form.numbers]))
        assert not np.allclose(start.mean, first.mean, rtol=1e-9), form.effect


def test_the_form_of_moved_modes_gives_back_what_was_moved():
    """All stiffness times 0.98: the fit of the modal form finds it within 4 of its own sd."""
    first, second, nominal = parts(chain(10), chain(11, scale=(0.98, 0.98, 0.98)))
    assert len(nominal.modes) == 3
    form = [f for f in all_forms(nominal, ('stiffness_scale',)) if not f.place][0]
    found = fit(nominal, Averages(second.mean, first.freedom, second.freedom), (form,))
    assert abs(found.x[2] - np.log(0.98)) < 4 * np.sqrt(found.covariance[2, 2])
    assert np.sqrt(found.covariance[2, 2]) < 0.003      # and its spread is small


def test_a_linear_structure_does_not_depend_on_its_amplitude():
    """Slopes of three modes over their spreads: none beyond 4, so the spread is not too small."""
    one = chain(12)
    _, _, nominal = parts(one, one)
    found = amplitude_dependence(one.values, RATE_HZ, nominal.modes)
    assert np.abs(found.frequency_slopes / found.frequency_stds).max() < 4
    assert (found.bursts / found.burst_stds).max() < 4


def test_steps_and_rails_are_read_off_exactly():
    """Rounded values have their step, clipped ones their rail, others neither."""
    values = np.random.default_rng(13).standard_normal(5000)
    assert step_of(np.rint(values / 0.05) * 0.05) == pytest.approx(0.05)     # round-off only
    assert step_of(values) == 0.0
    assert limit_of(np.clip(values, -1.5, 1.5)) == 1.5
    assert limit_of(values) == 0.0


def test_too_short_says_how_long():
    """Ten samples are refused with a length."""
    with pytest.raises(ValueError, match='are needed'):
        plan(60, 50.0, 3)
