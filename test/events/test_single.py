"""A single shock in a vibration that repeats itself is timed by the periods beside it."""
import numpy as np
import pytest
from ssi_ros.events.single import carrier_rows, single_event
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.periodic.period import autocorrelation
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.records import Samples

RATE_HZ, ROWS, PERIOD = 1000.0, 12_000, 330.0


def rattling(seed, amplitude=1.0, shock_at=None, shock=0.0):
    """Return a vibration with harmonics and bursts in each period, and a half-sine on top."""
    rng, t = np.random.default_rng(seed), np.arange(ROWS)
    phase = 2 * np.pi * t / PERIOD
    wave = np.sin(phase) + 0.2 * np.sin(3 * phase + 1)
    burst = np.exp(-(t % PERIOD) / 20)[:, None] * rng.standard_normal((ROWS, 2))
    values = amplitude * (wave[:, None] * [1.0, 0.9] + 0.2 * burst)
    values += 0.01 * rng.standard_normal((ROWS, 2))
    if shock_at is not None:
        half = np.arange(int(PERIOD / 5))
        values[shock_at:shock_at + len(half)] += shock * np.sin(
            np.pi * half / len(half))[:, None]
    return values


def test_the_period_is_that_of_the_vibration_and_noise_has_none():
    """330 rows to a row, whatever the bursts."""
    assert carrier_rows(autocorrelation(rattling(1))) == pytest.approx(PERIOD, abs=1)
    noise = np.random.default_rng(2).standard_normal((ROWS, 2))
    assert carrier_rows(autocorrelation(noise)) is None


@pytest.mark.parametrize('amplitude', [0.5, 1.0, 2.0])
def test_a_shock_is_timed_at_any_amplitude_and_none_is_found_without(amplitude):
    """Half of the amplitude, within a quarter of a period; the reference is at amplitude 1."""
    usual = rattling(3)
    row, size, p_value = single_event(
        usual, rattling(4, amplitude, 7000, 0.5 * amplitude), autocorrelation)
    assert row == pytest.approx(7000 + PERIOD / 10, abs=PERIOD / 4)
    assert size > 10 and p_value < 1e-3
    assert single_event(usual, rattling(5, amplitude), autocorrelation) is None


def test_what_the_reference_has_is_no_difference():
    """The same shock in both, at other times."""
    one, two = rattling(6, 1.0, 3000, 0.5), rattling(7, 1.0, 7000, 0.5)
    assert single_event(one, two, autocorrelation) is None


def test_the_diagnosis_names_impulses_with_the_time():
    """One shock in 12 s of vibration: impulses, at 7.0 s to 0.1 s."""
    one, two = (Samples(v, RATE_HZ, ('base', 'board'))
                for v in (rattling(8), rattling(9, 1.0, 7000, 0.5)))
    found = diagnose(RecordedNominal(one), two)
    assert found.verdict['effects'] == ('impulsive_events',)
    assert any(abs(float(s.split(' at ')[1].split(' s')[0]) - 7.0) < 0.1
               for s in found.signs if 'single event' in s)
