"""The live meter: the right model is quiet, effects are seen, the alarm keeps its rate."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.effects.stream import stream_setup
from ssi_ros.gap.online.calibration import LiveSettings, prepare
from ssi_ros.gap.online.e_detector import Bank, bets_on, quiet, step
from ssi_ros.gap.online.imputation import fill
from ssi_ros.gap.online.sliding import LiveGap
from ssi_ros.gap.online.stream import LiveStream
from ssi_ros.identify.grid import Grid
from ssi_ros.model import load_spacecraft
from ssi_ros.records import Samples
from ssi_ros.ros.last_rows import LastRows

SETTINGS = LiveSettings(window_s=60.0, hop_s=10.0, false_alarm_every_s=3600.0)
WATCHED = ('sensor_gain', 'array_asymmetry', 'hub_inertia', 'damping_scale', 'sensor_noise')


@pytest.fixture(scope='module')
def spacecraft():
    return load_spacecraft()


@pytest.fixture(scope='module')
def model(spacecraft):
    return prepare(spacecraft, SETTINGS, effects=WATCHED)


def record(spacecraft, *texts, duration_s=300.0, seed=3):
    """Return a record with effects in it."""
    return simulate_setup(inject(spacecraft, [parse_effect(t) for t in texts], duration_s), seed)


def updates_of(model, samples, settings=SETTINGS, chunk=None):
    """Return the updates of a record, pushed in chunks of rows."""
    live = LiveGap(model, samples.channels, samples.start_ns, settings)
    chunk = chunk or len(samples.values)
    return [u for first in range(0, len(samples.values), chunk)
            for u in live.push(samples.values[first:first + chunk])]


def test_bets_are_fair():
    """The mean factor of a bet is one: the price is the exact log mean of the exponential."""
    rng = np.random.default_rng(1)
    weights = rng.standard_normal(60)
    weights /= np.linalg.norm(weights)
    z = (rng.exponential(size=(200_000, 60)) - 1) @ weights
    for tilt, price in bets_on(weights, 1.0, 1.0):
        factors = np.exp(tilt * z - price)
        # 5 standard errors: a price wrong by 1 % of itself is seen at the larger tilts
        assert abs(factors.mean() - 1) < 5 * factors.std() / np.sqrt(len(z))


def test_alarm_keeps_the_declared_time():
    """A bank of dependent fair bets: the mean time to a false alarm is as declared or more."""
    rng, most = np.random.default_rng(2), 50.0
    bets = bets_on(np.ones(1), 1.0, 1.0)
    tilt, price = np.array(bets * 2).T
    bank = Bank(np.repeat([0, 1], len(bets)), tilt, price, np.full(len(tilt), -np.log(len(tilt))))
    times = []
    for _ in range(100):
        alarm, n = quiet(bank), 0
        while alarm.raised_ns is None:
            n += 1
            shared = rng.exponential() - 1               # one statistic, watched twice
            alarm = step(alarm, bank, np.array([shared, shared]), np.log(most), n)
        times.append(n)
    # 3 standard errors below is still a pass; a bank without a mixture's weights halves the time
    assert np.mean(times) > most - 3 * np.std(times) / np.sqrt(len(times))
    assert np.mean(times) < 6 * most        # and it is not so by never betting


def test_alarm_stays_until_it_is_acknowledged():
    """The first crossing is kept with its time and cause; an empty hop makes no bet."""
    bank = Bank(np.array([0, 1]), np.array([1.0, 1.0]), np.array([0.5, 0.5]), np.log([0.5, 0.5]))
    alarm = step(quiet(bank), bank, np.array([0.0, 20.0]), 5.0, 10)
    assert (alarm.raised_ns, alarm.statistic) == (10, 1)
    later = step(alarm, bank, np.array([-40.0, -40.0]), 5.0, 20)
    assert later.level < 0 and later.raised_ns == 10
    pause = step(quiet(bank), bank, None, 5.0, 10)
    np.testing.assert_array_equal(pause.log_sums, 0.0)


def test_right_model_is_quiet(spacecraft, model):
    """Twenty minutes of the model itself: no alarm, the meter within its floor."""
    live = LiveGap(model, [s.name for s in spacecraft.sensors], 0, SETTINGS)
    _, _, blocks = stream_setup(spacecraft, (), 17, block_s=1200.0)
    updates = live.push(next(blocks).values)
    assert len(updates) == 120 and updates[-1].raised_ns is None
    # 20 windows that share no hop: 5 beyond 1.96 sd have a chance below 0.3 %
    beyond = [abs(u.deviations) > 1.96 for u in updates[5::6]]
    assert sum(beyond) < 5
    # scores of the right model: variance 1 within what a thousand hops of calibration allow
    assert all(u.leading_p > 1e-4 for u in updates)


@pytest.mark.parametrize('text, site', [
    ('sensor_gain:channel=e1_a,scale=1.1', 'sensor'),
    ('array_asymmetry:array=E2,scale=0.97', 'structure'),
    ('damping_scale:scale=3', 'structure')])
def test_effect_is_seen(spacecraft, model, text, site):
    """A clear effect: alarm within 50 s of its begin, the right leading effect and site."""
    live = LiveGap(model, [s.name for s in spacecraft.sensors], 0, SETTINGS)
    assert live.push(record(spacecraft, duration_s=120.0).values)[-1].raised_ns is None
    last = live.push(record(spacecraft, text, duration_s=100.0, seed=4).values)[-1]
    assert last.raised_ns is not None and last.raised_ns <= 170e9
    assert last.leading == text.split(':')[0] and last.deviations > 3
    assert max(last.sites, key=last.sites.get) == site
    live.acknowledge()
    assert live.alarm.raised_ns is None


def test_line_leads(spacecraft, model):
    """A sine at no template's frequency is named as a line, at the right bin."""
    last = updates_of(model, record(
        spacecraft, 'harmonic_disturbance:frequency_hz=17.3,torque_n_m=1.5'))[-1]
    assert last.leading == 'harmonic_disturbance' and last.leading_text == 'line at 17.3 Hz'
    assert last.raised_ns is not None
    assert max(last.sites, key=last.sites.get) == 'excitation'


def test_levels_raise_no_alarm(spacecraft):
    """Half the power of the excitation and 20 % more sensor noise are nuisances, not gaps."""
    noisier = [f'sensor_noise:channel={s.name},scale=1.2' for s in spacecraft.sensors]
    nominal = spacecraft.excitation
    weaker = replace(spacecraft, excitation=replace(
        nominal, process_noise_rms=nominal.process_noise_rms / 2 ** 0.5))
    model = prepare(spacecraft, SETTINGS, effects=('sensor_gain', 'damping_scale'))
    last = updates_of(model, record(weaker, *noisier, duration_s=300.0))[-1]
    assert last.raised_ns is None
    # the fitted levels follow the true ones: those of 60 s scatter by 3 and 10 %
    assert last.levels['process_noise'] == pytest.approx(0.5, rel=0.1)
    assert last.levels['sensor_noise'] == pytest.approx(1.44, rel=0.3)


def test_bunching_does_not_matter(spacecraft, model):
    """One push or many, and columns in another order: the same updates, to the bit."""
    samples = record(spacecraft, duration_s=100.0)
    whole = updates_of(model, samples)
    assert whole == updates_of(model, samples, chunk=137)
    turned = Samples(samples.values[:, ::-1], samples.rate_hz, samples.channels[::-1])
    assert whole == updates_of(model, turned)


def test_missing_rows(spacecraft, model):
    """Lost rows are filled and no gap to the model; what is silent or too long is named."""
    dropped = record(spacecraft, 'dropped_samples:fraction=0.002', duration_s=600.0)
    last = updates_of(model, dropped)[-1]
    assert last.raised_ns is None and abs(last.deviations) < 4
    # what the rows around do not determine is missing in filled rows: more of them were an alarm
    many = updates_of(model, record(spacecraft, 'dropped_samples:fraction=0.05', duration_s=600.0))
    assert not any(u.measured for u in many) and many[-1].raised_ns is None
    assert 'channel e1_a misses 6 % of its samples' in many[-1].reason
    values = record(spacecraft, duration_s=100.0).values.copy()
    values[3000:, 2] = np.nan
    values[1000:1050] = np.nan
    silent = updates_of(model, Samples(values, 100.0, dropped.channels))
    assert 'channel e1_a misses 5 % of its samples' in silent[1].reason
    assert silent[2].raised_ns is None and np.isfinite(silent[2].value)
    assert 'e2_a misses 100 % of its samples' in silent[-1].reason
    assert not np.isfinite(silent[-1].value) and 'no usable hop' in silent[-1].reason


def test_filled_samples_are_near_the_lost_ones(spacecraft, model):
    """A lost row is told from its neighbours to a small part of its rms."""
    values = record(spacecraft, duration_s=20.0).values
    holes = values.copy()
    holes[::50] = np.nan
    holes[775:778, 1] = np.nan
    filled = fill(holes, model.covariance)
    lost = np.isnan(holes)
    np.testing.assert_array_equal(filled[~lost], values[~lost])
    # the forces of the lost instant itself cannot be known: they make a fifth of the rms
    assert np.std((filled - values)[lost]) < 0.25 * values.std()


def test_wild_and_constant_samples_are_survived(spacecraft, model):
    """Infinite, huge and constant samples: a reason and an alarm, never a fault."""
    values = record(spacecraft, duration_s=120.0).values.copy()
    values[100, 0], values[200, 1], values[300, 2] = np.inf, 1e300, 1e6
    values[6000:, 3] = 0.25
    updates = updates_of(model, Samples(values, 100.0, [s.name for s in spacecraft.sensors]))
    assert len(updates) == 12 and updates[0].raised_ns is not None      # 1e6 m/s^2 is a gap
    assert 'channel e2_b is constant' in updates[-1].reason


def test_offset_is_no_gap(spacecraft, model):
    """A constant acceleration of 1 mg on a channel leaves the meter where it was."""
    samples = record(spacecraft, duration_s=300.0)
    offset = samples.values + np.array([0.01, 0.0, -0.01, 0.0])
    last = updates_of(model, Samples(offset, 100.0, samples.channels))[-1]
    assert last.raised_ns is None
    assert last.deviations == pytest.approx(updates_of(model, samples)[-1].deviations, abs=1e-6)


def test_clock_jump_begins_a_new_window(spacecraft, model):
    """Rows of another segment: a new window, the alarm goes on, the record begins anew."""
    samples = record(spacecraft, 'sensor_gain:scale=1.1', duration_s=80.0)
    grid, stream = Grid(samples.channels, 100.0), LiveStream(model, samples.channels, SETTINGS)
    kept = LastRows(samples.channels, 100.0, 15.0)
    stamps = samples.stamps_ns() + 10 ** 18
    stamps[4000:] += 10 ** 13
    updates = []
    for first in range(0, 8000, 500):
        for c in range(4):
            part = slice(first, first + 500)
            grid.push(c, stamps[part], samples.values[part, c])
        for rows in grid.rows(flush=first == 7500):
            updates += stream.push(rows)
            kept.push(rows)
    assert len(grid.jumps) == 1 and len(updates) == 8
    assert updates[4].start_ns == stamps[4000] and 'holds 10 s of 60 s' in updates[4].reason
    assert updates[3].raised_ns is not None and updates[-1].raised_ns == updates[3].raised_ns
    last = kept.samples()
    assert last.duration_s == 15.0 and last.start_ns == stamps[-1500]
    np.testing.assert_array_equal(last.values, samples.values[-1500:])


@pytest.mark.parametrize('changes, words', [
    ({'hop_s': 1.0, 'band_bins': 100}, 'hop_s=1 has too few frequency bins'),
    ({'hop_s': 90.0}, 'window_s=60 is shorter than hop_s=90'),
    ({'false_alarm_every_s': 1.0}, 'outside 600 to 1e+10')])
def test_bad_settings_are_told(spacecraft, changes, words):
    """What was given, and what is allowed."""
    with pytest.raises(ValueError) as error:
        prepare(spacecraft, replace(SETTINGS, **changes))
    assert words in str(error.value)


def test_channels_of_another_model_are_told(model):
    """The channels that are missing are named."""
    with pytest.raises(ValueError, match='the model also has e1_a, e2_b'):
        LiveGap(model, ('e1_b', 'e2_a', 'x'), 0, SETTINGS)


def test_model_with_a_drift_is_refused(spacecraft):
    """A nominal model that needs the length of a record cannot be met by a stream."""
    with pytest.raises(ValueError, match='stiffness_drift, which is defined over a whole record'):
        prepare(spacecraft, SETTINGS, present=[parse_effect('stiffness_drift:change=0.1')])
