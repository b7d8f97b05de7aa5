"""Fits between two recordings: unbiased scores, one answer from every start."""
import numpy as np
import pytest
from reference_records import chain
from ssi_ros.gap.nominal.modal.fit import fit
from ssi_ros.gap.nominal.modal.prediction import Averages
from ssi_ros.gap.nominal.modal.reference import make_nominal
from ssi_ros.gap.nominal.modal.starting_values import all_forms
from ssi_ros.gap.spectra.band_averages import plan, spectra_of
from ssi_ros.levels.free import missing_noise


def prepared(one, two):
    """Return the nominal of a recording, and the Spectra of it and of another."""
    cut = plan(len(one.values), one.rate_hz, len(one.channels))
    before, after = (spectra_of(s.values, cut) for s in (one, two))
    return make_nominal(one.values, one.channels, cut, before.mean, before), before, after


@pytest.mark.parametrize('scale', [0.9, 1.1])
def test_slopes_draw_a_gain_nowhere(scale):
    """
    From null and from the truth fits end at one size, within its deviations.

    With slopes around a pool that the filters of the form had not passed they ended apart, and 5
    deviations and more from the truth.
    """
    one, two = chain(23), chain(24)
    two = type(two)(two.values * [1.0, scale, 1.0], two.rate_hz, two.channels)
    nominal, before, after = prepared(one, two)
    form = next(f for f in all_forms(nominal, ('sensor_gain',)) if f.place['channel'] == 'b')
    record = Averages(after.mean, before.freedom, after.freedom)
    from_null, from_truth = (fit(nominal, record, (form,), [0.0, 0.0, x], 40)
                             for x in (0.01, scale - 1))
    std = np.sqrt(from_truth.covariance[2, 2])
    assert abs(from_truth.x[2] - (scale - 1)) < 3 * std
    assert abs(from_null.x[2] - from_truth.x[2]) < 0.5 * std


@pytest.mark.parametrize('level', [1.0, 2.0])
def test_noise_is_added_to_what_has_less_of_it(level):
    """Beside motion twice as large the same noise is a quarter; at one level nothing changes."""
    nominal, *both = prepared(chain(31), chain(32, level=level))
    one, two = missing_noise(nominal, *both)
    assert not one.any() or level == 1.0
    added = two / nominal.floor
    # the floor is a bound of the noise: three of it would come with four times the power
    assert np.all(added >= 0.0) and np.all(added < 3.3)
    assert added.max() > 0.05 if level > 1.0 else added.max() < 0.05


def test_a_moved_sensor_is_tied_with_a_structure_that_changed_near_it():
    """Its free components are what a spring or a mass beside the sensor also makes."""
    nominal, *_ = prepared(chain(23), chain(24))
    form = all_forms(nominal, ('sensor_misplacement',))[0]
    assert form.effect == 'sensor_misplacement'
    assert {'added_mass', 'array_asymmetry', 'hinge_compliance'} <= set(form.equivalents)
