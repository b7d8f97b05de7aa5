"""Noise does not grow with the forces: bands that hold noise only, beside another level."""
import numpy as np
from reference_records import chain
from ssi_ros.effects import library
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.records import Samples

NOISE = 0.1     # of the rms of the quieter recording: below the first mode little else is heard


def heard(seed, level=1.0):
    """Return a chain at a level, the noise of its sensors that of all."""
    samples, usual = chain(seed, level=level), chain(1).values.std(axis=0)
    noise = np.random.default_rng(seed).standard_normal(samples.values.shape)
    return Samples(samples.values + NOISE * usual * noise, samples.rate_hz, samples.channels)


def test_noise_that_is_added_scatters_as_noise_does():
    """Added to the mean alone it would leave the louder record smoother than the reference."""
    recordings = RecordedNominal(heard(41)).compare(
        heard(42, 1.25), DiagnosisSettings(), tuple(library()), lambda share: None).recordings

    def scatter(spectra):
        power = np.einsum('gbii->gbi', spectra.groups).real[:, spectra.cut.middles_hz < 1.0]
        return np.mean(np.var(power, axis=0) / np.mean(power, axis=0) ** 2)
    assert 0.75 < scatter(recordings.two) / scatter(recordings.one) < 1.33


def test_another_level_is_no_colour():
    """Within the floor, and no force of another colour where noise alone is heard."""
    found = diagnose(RecordedNominal(heard(41)), heard(42, 1.25))
    assert found.outcome == 'WITHIN_FLOOR'
