"""What kind of motion two recordings hold, and what an answer may then say of them."""
import numpy as np
import pytest
from scipy.signal import butter, lfilter
from ssi_ros.effects import applicable
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.periodic.repeats import repeats_of
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.band_averages import plan
from ssi_ros.records import Samples
from ssi_ros.regimes.common_drive import drive_evidence
from ssi_ros.regimes.decays import moved, unresolved, vibration
from ssi_ros.regimes.regime import Regime
from ssi_ros.regimes.varying_level import steady_share

RATE_HZ, ROWS, PERIODS = 200.0, 2048, 6
NAMES = 'a', 'b', 'c'
SHAPES = np.array([[1.0, 0.5, 0.2], [0.4, -1.0, 0.6], [0.3, 0.5, -1.0]])


def driven(seed, factor=1.0, colour=0.0, gain=1.0, swing=0.0):
    """Return three modes under one signal that repeats itself; rattle varies above 40 Hz."""
    rng, drive = np.random.default_rng(seed), np.random.default_rng(1)
    f = np.fft.rfftfreq(ROWS, 1 / RATE_HZ)
    force = np.exp(2j * np.pi * drive.random(len(f))) * ((f > 2) & (f < 30))
    force /= 1 + 1j * f * colour
    modes = [f ** 2 / (f0 ** 2 - f ** 2 + 0.04j * f0 * f)
             for f0 in factor * np.array([7.0, 11.0, 19.0])]
    lines = sum(m[:, None] * s for m, s in zip(modes, SHAPES)) * force[:, None]
    lines[:, 1] *= gain
    clean = np.tile(np.fft.irfft(lines, ROWS, axis=0), (PERIODS, 1))
    rattle = np.fft.irfft(np.exp(2j * np.pi * drive.random((len(f), 3)))
                          * (f > 40)[:, None], ROWS, axis=0)
    levels = 0.2 * np.exp(swing * rng.standard_normal(PERIODS))
    values = clean + np.concatenate([level * rattle for level in levels])
    return values + 1e-3 * clean.std() * rng.standard_normal(values.shape)


def split(values):
    """Return the Repeats of a recording."""
    return repeats_of(values, RATE_HZ, ROWS)


def test_bands_whose_level_varies_count_as_one():
    """Rattle that changes by a tenth from period to period; what is steady keeps its weight."""
    cut = plan(ROWS * PERIODS, RATE_HZ, 3, ROWS)
    high = cut.middles_hz > 50
    for swing, least, most in ((0.0, 0.5, 1.0), (0.1, 0.0, 0.05)):
        both = [split(driven(seed, swing=swing)) for seed in (2, 3)]
        share = steady_share(both, np.zeros(3), cut, (30.0, 30.0))
        assert least <= np.median(share[high]) <= most
        assert np.median(share[cut.middles_hz < 25]) > 0.5


@pytest.mark.parametrize('change, structural', [
    ({}, False), ({'colour': 0.05}, False), ({'gain': 1.3}, False), ({'factor': 0.97}, True)])
def test_neither_a_drive_nor_one_sensor_changes_three_channels_unevenly(change, structural):
    """A colour of the drive and a gain of a channel leave ratios, modes 3 % lower do not."""
    one, two = split(driven(4)), split(driven(5, **change))
    assert drive_evidence(one, two).structural == structural


def ringing(frequency_hz, seconds, decay=0.3, rate_hz=1000.0, seed=6):
    """Return a vibration that dies away by a time constant [s], in two channels."""
    t = np.arange(int(seconds * rate_hz)) / rate_hz
    wave = np.exp(-t / decay) * np.sin(2 * np.pi * frequency_hz * t)
    noise = np.random.default_rng(seed).standard_normal((len(t), 2))
    return wave[:, None] * [1.0, 0.7] + 1e-3 * noise


def test_a_vibration_has_a_frequency_however_short_the_record():
    """To a tenth of the reciprocal of the length; its neighbour is another, its repeat is not."""
    one, two = (vibration(ringing(f, 0.7), 1000.0) for f in (26.3, 28.2))
    assert one.frequency_hz == pytest.approx(26.3, abs=0.14)
    assert moved(one, two) and not moved(one, vibration(ringing(26.5, 0.7), 1000.0))
    assert one.dies_away
    assert unresolved(one, 30.0) and not unresolved(one, 20.0)


@pytest.mark.parametrize('after_hz, outcome', [(26.3, 'TOO_LITTLE_DATA'), (30.8, 'UNEXPLAINED')])
def test_transients_are_refused_or_the_structure_is_another(after_hz, outcome):
    """Nothing is named of two decays; where the frequency is another, the place is."""
    one, two = (Samples(ringing(f, 1.4, 1.0, seed=s), 1000.0, NAMES[:2])
                for f, s in ((26.3, 7), (after_hz, 8)))
    found = diagnose(RecordedNominal(one), two)
    assert found.outcome == outcome and not found.verdict['effects']
    assert 'too short' in found.reason or 'not stationary' in found.reason
    if outcome == 'UNEXPLAINED':
        assert found.where.site['structure'] == 1.0


def test_another_level_of_one_vibration_is_no_fault():
    """Twice the amplitude with other rattle: nothing is named, the place is the excitation."""
    t = np.arange(12_000) / 1000.0

    def shaken(level, seed):
        noise = np.random.default_rng(seed).standard_normal((len(t), 2))
        burst = np.exp(-(t % 0.33) / 0.02)[:, None] * lfilter(*butter(2, 0.2 * level), noise, 0)
        wave = np.sin(2 * np.pi * t / 0.33)
        return Samples(level * (wave[:, None] * [1.0, 0.9] + 0.2 * level * burst)
                       + 0.01 * noise, 1000.0, NAMES[:2])
    found = diagnose(RecordedNominal(shaken(1.0, 9)), shaken(2.0, 10))
    assert found.outcome == 'UNEXPLAINED' and not found.verdict['effects']
    assert found.where.site['excitation'] == 1.0


def test_random_motion_limits_no_answer():
    """Modes under white noise, one of them ringing long: every effect may be named."""
    rng = np.random.default_rng(11)
    b, a = butter(1, [0.1, 0.105], 'bandpass')
    values = lfilter(b, a, rng.standard_normal((20_000, 3)), axis=0) @ SHAPES
    one, two = (Samples(v, RATE_HZ, NAMES)
                for v in np.split(values + 0.01 * rng.standard_normal(values.shape), 2))
    names = applicable(None, None)
    comparison = RecordedNominal(one).compare(two, DiagnosisSettings(), names)
    assert comparison.recordings.regime == Regime()
    assert all(comparison.recordings.regime.allows(n) for n in names)
