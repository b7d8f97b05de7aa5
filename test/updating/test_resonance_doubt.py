"""How surely a line at a resonance is a line: by quadrature, by formula, and on records."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm
from ssi_ros.effects import effect_class, inject, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors.input_reconstruction import reconstruct
from ssi_ros.gap.detectors.tone import detect_tone
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import frame_of, whole_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.updating.resonance_doubt import discounted, resonance_doubt
from ssi_ros.windows import excess_around

ROWS, RATE_HZ = 60_000, 100.0
LOWER = -1.1            # logarithm of the true damping of the slowest modes over the model's


def doubt_of(spacecraft, rows=ROWS):
    """Return frequencies of the lines of a record, and the doubt of a model at them."""
    frame = whole_frame(rows, RATE_HZ, DiagnosisSettings(), 1.0)
    simulator = Simulator(spacecraft, frame, rows / RATE_HZ)
    return frame.frequencies_hz, resonance_doubt(simulator, simulator.setup(Candidate()), frame)


@pytest.mark.parametrize('power, std', [(12.0, 0.1), (20.0, 0.4), (40.0, 0.6)])
def test_a_power_counts_by_its_chance_among_all_heights(power, std):
    """exp(-power) averaged over a lognormal expected power, the integral by quadrature."""
    chance, _ = quad(lambda z: norm.pdf(z) * np.exp(-power * np.exp(-std * z)), -10, 12,
                     epsabs=0, epsrel=1e-8, limit=400)
    found = discounted(np.array([power]), np.array([std]))[0]
    assert found < power and abs(found + np.log(chance)) < 0.1 * found
    assert discounted(np.array([power]), np.zeros(1))[0] == power


def test_a_longer_record_leaves_less_doubt_and_an_exact_model_none():
    """At a peak 2 (1 / s^2 + 2 pi zeta f T)^-1/2, s the declared deviation; beside it less."""
    spacecraft = load_spacecraft()
    at_hz, doubt = doubt_of(spacecraft)
    _, longer = doubt_of(spacecraft, 4 * ROWS)
    assert 0.25 < doubt.max() < 2 * 0.3 and at_hz[doubt.argmax()] < 0.5
    assert longer.max() < 0.8 * doubt.max()
    assert np.median(doubt) < 0.05 < doubt[np.abs(at_hz - 0.37).argmin()] < doubt.max() / 2
    assert not doubt_of(replace(spacecraft, uncertainty=EXACT))[1].any()


@pytest.mark.slow
def test_a_mode_that_damps_less_than_its_model_is_no_sine():
    """Of ten records few have a line where the damping is a third; with an exact model most do."""
    spacecraft = load_spacecraft()
    names, _ = declared(spacecraft)
    errors = np.array([LOWER * (n in ('damping E1 1', 'damping E2 1')) for n in names])
    truth = replace(spacecraft, calibration=Calibration(names, errors))
    counts = {}
    for kind, model in (('exact', replace(spacecraft, uncertainty=EXACT)), ('own', spacecraft)):
        found = 0
        for seed in range(10):
            samples = simulate_setup(inject(truth, (), 600.0), 300 + seed)
            settings = DiagnosisSettings()
            simulator = Simulator(model, frame_of(samples, settings), samples.duration_s)
            fitted = fit(simulator, simulator.evidence(samples))
            one = reconstruct(simulator, fitted, samples, settings)
            line = detect_tone(effect_class('harmonic_disturbance'), one)
            found += line is not None and line.p_value < 1e-3
        counts[kind] = found
    assert counts['own'] <= 1 and counts['own'] + 3 <= counts['exact'], counts


def test_a_resonance_elsewhere_is_no_line():
    """A hump of 40 lines is nothing over its neighbours, a line is nearly what it was."""
    rng = np.random.default_rng(1)
    power = rng.exponential(size=2000)
    power[900:940] *= 30.0
    power[300] = 40.0
    found = power / excess_around(power, np.log(2), 33)
    assert found[900:940].max() < 12.0 < 25.0 < found[300] <= 40.0
    assert np.all(found <= power)
