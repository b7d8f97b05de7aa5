"""What was lost or cut off is drawn as the model has it, given what is there."""
from dataclasses import replace

from gap_records import evidence_of, record, SETTINGS
import numpy as np
import pytest
from ssi_ros.effects import inject, library, parse_effect, simulate_setup
from ssi_ros.gap.detectors import detect_in_samples
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.nominal.simulator import at_levels
from ssi_ros.gap.spectra.imputation import completed, filled, without_clipped
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.gap.spectra.thresholds import LIMITS
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT

RATE_HZ = 100.0
ROWS = 11_987           # a prime number, no period of a fast transform


@pytest.fixture(scope='module')
def both():
    return record(120.0)


@pytest.fixture
def samples(both):
    return both[0]


@pytest.fixture
def simulator(both):
    return both[1]


def clipped_at(samples, limit):
    """Return clipped samples, and the effect that clips them."""
    return (replace(samples, values=np.clip(samples.values, -limit, limit)),
            [parse_effect(f'saturation:limit_m_s2={limit:.17g}')])


def test_what_a_rail_cut_off_is_drawn_from_beyond_it(samples, simulator):
    """Three parts in a hundred at the rails: less error than that of the clipped record."""
    samples = replace(samples, values=samples.values[:ROWS])
    limit = np.quantile(np.abs(samples.values), 0.97)
    clipped, rails = clipped_at(samples, limit)
    clipped, limits = without_clipped(clipped, rails)
    whole = filled(simulator, clipped, limits=limits)
    cut = np.isnan(clipped.values)
    assert np.array_equal(whole.values[~cut], clipped.values[~cut])
    assert np.all(whole.values[cut] * np.sign(limits[cut]) >= limit * (1 - 1e-9))
    left, lost = (whole.values - samples.values)[cut], np.abs(samples.values[cut]) - limit
    assert np.sqrt(np.mean(left ** 2)) < 0.6 * np.sqrt(np.mean(lost ** 2))


@pytest.mark.parametrize('share', [0.02, 0.2])
def test_lost_rows_leave_the_valleys_of_the_spectrum_as_they_are(samples, simulator, share):
    """The noise of the sensors, 40 dB below the resonances, is that of the whole record."""
    values = samples.values.copy()
    values[np.random.default_rng(5).random(len(values)) < share] = np.nan
    whole = filled(simulator, replace(samples, values=values))
    before, after = (fit(simulator, evidence_of(simulator, s)) for s in (samples, whole))
    assert after.levels[-1] / before.levels[-1] == pytest.approx(1.0, abs=0.25)
    assert abs(after.likelihood - before.likelihood) < 4 * np.sqrt(len(values))


@pytest.mark.slow
def test_level_and_bias_are_told_with_the_holes():
    """A loud record with biased sensors, cut at the rails: both come out as they are."""
    level, bias, seconds = 2.0, np.array([4e-3, 0.0, -4e-3, 0.0]), 300.0
    loud = at_levels(load_spacecraft(), np.array([level, level, 1.0]))
    raw = simulate_setup(inject(loud, (), seconds), 11)
    raw = replace(raw, values=raw.values + bias)
    clipped, rails = clipped_at(raw, 0.1)
    _, simulator = record(seconds)
    simulator, whole, _, levels = completed(simulator, *without_clipped(clipped, rails), SETTINGS)
    assert 0.01 < np.mean(np.abs(clipped.values) >= 0.1) < 0.1
    assert levels[1] == pytest.approx(level, rel=0.01) and levels[-1] < 1.3
    there = np.abs(clipped.values) < 0.1
    for c, (mean, true) in enumerate(zip(bias, raw.values.mean(axis=0))):
        told = (clipped.values - whole.values)[there[:, c], c].mean()
        assert told == pytest.approx(true, abs=2e-4), c
        assert true == pytest.approx(mean, abs=2e-4)


def test_what_cannot_be_told_is_left(samples, simulator):
    """Rails that half of the samples are at, and a hole too long, stay as they are."""
    limit = np.median(np.abs(samples.values)) / 4
    clipped, rails = clipped_at(samples, limit)
    assert without_clipped(clipped, rails)[0] is clipped
    assert without_clipped(samples, [])[0] is samples
    values, longest = samples.values.copy(), int(LIMITS.gap_s.value * RATE_HZ)
    values[1000:1001 + longest], values[5000] = np.nan, np.nan
    whole = filled(simulator, replace(samples, values=values), longest_s=LIMITS.gap_s.value)
    assert np.isnan(whole.values[1000:1001 + longest]).all()
    assert np.isfinite(whole.values[5000]).all()


def test_long_records_are_filled_in_blocks(samples, simulator, monkeypatch):
    """What a block draws at its end, the next one knows: the valleys stay as they are."""
    monkeypatch.setattr('ssi_ros.gap.spectra.imputation.BLOCK_S', 60.0)
    values = samples.values[:ROWS].copy()
    values[np.random.default_rng(6).random(len(values)) < 0.05] = np.nan
    drawn = filled(simulator, replace(samples, values=values)).values
    assert np.isfinite(drawn).all()
    whole = replace(samples, values=np.concatenate([drawn, samples.values[ROWS:]]))
    before, after = (fit(simulator, evidence_of(simulator, s)) for s in (samples, whole))
    assert after.levels[-1] / before.levels[-1] == pytest.approx(1.0, abs=0.25)


def test_the_frame_of_a_filled_record_knows_no_holes(samples, simulator):
    """Its taper overlaps itself as that of a whole record does."""
    values = samples.values.copy()
    values[::50] = np.nan
    rails = np.full(values.shape, np.nan)
    side, *_ = completed(simulator, replace(samples, values=values), rails, SETTINGS)
    whole = make_frame(len(values), RATE_HZ, SETTINGS)
    np.testing.assert_array_equal(side.frame.overlap, whole.overlap)


def test_few_values_at_rails_are_seen_on_all_channels_together():
    """One value or two of each channel at the same limit; rounded ones may be so by chance."""
    samples, _ = record(120.0)
    limit = np.sort(np.abs(samples.values).ravel())[-5]
    clipped, (rails,) = clipped_at(samples, limit)
    (found,) = detect_in_samples(clipped, library())
    assert found.parameters['limit_m_s2'] == pytest.approx(rails.limit_m_s2, rel=1e-12)
    assert detect_in_samples(samples, library()) == ()


@pytest.mark.slow
def test_gaps_of_a_short_record_are_no_line_and_no_drift():
    """Of 100 s, in which the slowest mode falls to a third, 5 % lost in two gaps are no gap."""
    # lags beyond half of the record were faded: draws did not go on with the phase of that mode
    model = replace(load_spacecraft(), uncertainty=EXACT)
    for seed in (5, 6):
        short = simulate_setup(inject(model, (), 100.0), seed)
        values = short.values.copy()
        for first, last in ((2000, 2300), (4000, 4250)):
            values[first:last] = np.nan
        found = diagnose(model, replace(short, values=values))
        assert found.outcome == 'WITHIN_FLOOR' and found.gap['p_value'] > 1e-3


@pytest.mark.slow
def test_a_record_far_from_its_model_is_filled_as_well():
    """A drift of a hundred times the motion: levels of filled samples ran away to 1e25."""
    samples, simulator = record(120.0, [parse_effect(
        'sensor_drift:channel=e2_a,rms_m_s2=3,time_constant_s=7')])
    values = samples.values.copy()
    values[3000:3150] = np.nan
    samples, limits = without_clipped(replace(samples, values=values), ())
    whole, levels = completed(simulator, samples, limits, SETTINGS)[1::2]
    assert np.isfinite(whole.values).all() and np.isfinite(levels).all()
