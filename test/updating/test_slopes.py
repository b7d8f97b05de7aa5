"""Derivatives by the errors of a model: from the poles, against difference quotients."""
from craft import model, twin
import numpy as np
import pytest

from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.hermitian import real_vectors, white
from ssi_ros.model.errors import declared
from ssi_ros.updating.slopes import plain_slopes, slopes

EFFECTS = ('', 'sensor_gain:channel=e1_a,scale=1.1', 'added_mass:array=E1,mass_kg=1,along_m=5',
           'sensor_crosstalk:source=e1_a,channel=e2_a,gain=0.005', 'fuel_slosh:mass_kg=20',
           'channel_delay:channel=e1_b,delay_s=0.003', 'excitation_colour:corner_hz=20',
           'hinge_compliance:array=E2,stiffness_n_m_rad=1e6',
           # without oscillation: real poles, of which there is no pair
           'attitude_controller:bandwidth_hz=0.05,damping_ratio=1.5')


@pytest.mark.parametrize('text, late', [*((t, ()) for t in EFFECTS),
                                        (EFFECTS[3], (0.0, 0.31, -0.46, 0.12))])
def test_derivatives_are_those_of_difference_quotients(text, late):
    """All errors, whitened, and the score against a random Hermitian excess."""
    frame = make_frame(20000, 100.0, DiagnosisSettings(segment_s=5.0, band_bins=1))
    simulator = Simulator(twin(), frame, 200.0, late=late)
    candidate = Candidate((parse_effect(text),) if text else ())
    stds = declared(model())[1]
    base = simulator.expected(candidate)
    levels = np.linspace(0.7, 1.4, len(base.names))
    lower = np.linalg.inv(np.linalg.cholesky(base.at(levels)))
    found = plain_slopes(simulator, levels, stds, candidate)
    rows = found.whitened(lower[0])
    quotients = np.array([real_vectors(white(lower, change))[0] for change in slopes(
        simulator, base.at(levels), levels, stds, candidate)])
    # 1 %: a quotient over 1e-3 of a deviation, and single precision
    assert np.all(np.linalg.norm(rows - quotients, axis=1)
                  <= 0.01 * np.linalg.norm(quotients, axis=1) + 1e-4)
    half = np.random.default_rng(1).standard_normal((*lower[0].shape, 2)) @ [1.0, 1.0j]
    excess = half + half.conj().swapaxes(-1, -2)
    wanted = rows @ real_vectors(excess[None])[0]
    # rows are of single precision
    assert found.score(lower[0], excess) == pytest.approx(
        wanted, abs=1e-3 * np.abs(wanted).max())


@pytest.mark.parametrize('text', ['timestamp_jitter:rms_s=0.001', 'stiffness_drift:change=0.01',
                                  'nonstationary_excitation:depth=0.3,period_s=50'])
def test_what_is_no_sum_over_poles_is_left_to_quotients(text):
    """A drift, jitter and a level that varies."""
    frame = make_frame(20000, 100.0, DiagnosisSettings(segment_s=5.0, band_bins=1))
    simulator, stds = Simulator(twin(), frame, 200.0), declared(model())[1]
    assert plain_slopes(simulator, np.ones(2), stds, Candidate((parse_effect(text),))) is None
