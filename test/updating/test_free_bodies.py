"""Models of matrices with modes of a rigid body: derivatives, places of effects, calibration."""
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from slope_quotients import assert_slopes_are_quotients
from ssi_ros.effects import effect_class, inject, parse_effect, places, simulate_setup
from ssi_ros.effects.points import amplitude_between
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.linear_model import Channel, Input, LinearModel
from ssi_ros.model.modal_errors import modal_uncertainty
from ssi_ros.updating.calibrate import calibrate
from ssi_ros.updating.fit import fit_errors

SECONDS = 300.0
NAMES = tuple('abcd')
INNER = 'freedom=a,to=b'


@lru_cache
def model():
    """Return a chain of four masses that nothing holds, with errors of an untested model."""
    ends = np.eye(4)[:3] - np.eye(4)[1:]
    stiffness = ends.T @ np.diag([900.0, 1400.0, 700.0]) @ ends
    free = LinearModel(
        mass=np.diag([1.0, 2.0, 1.5, 1.0]), damping=4e-3 * stiffness / 5, stiffness=stiffness,
        input=np.eye(4)[:, [0, 3]], output=np.eye(4)[[0, 2]], freedoms=NAMES,
        drives=(Input('left', 1.0, 6.0), Input('right', 2.0)),
        sensors=tuple(Channel(f'acc_{n}', noise_rms=1e-2) for n in 'ac'), rate_hz=25.0)
    return replace(free, uncertainty=modal_uncertainty(
        free, frequency=0.01, damping=0.3, participation=0.03, shape=0.03, gain=0.01))


@lru_cache
def twin():
    """Return the chain that is recorded: each number off by its declared deviation."""
    names, stds = declared(model())
    return replace(model(), calibration=Calibration(
        names, stds * np.random.default_rng(5).standard_normal(len(stds))))


def test_a_rigid_motion_has_no_errors_of_frequency_or_damping():
    """Three of the four modes vibrate; the fourth has nothing that a record could tell."""
    names = declared(model())[0]
    assert [n for n in names if n.startswith(('frequency', 'damping'))] == [
        f'{kind} mode {k}' for k in (1, 2, 3) for kind in ('frequency', 'damping')]


@pytest.mark.parametrize('text', [
    '', f'connection_stiffness:{INNER},share=-0.08', 'point_mass:freedom=b,share=0.05',
    # a damper slows what no spring holds: a state without a position
    'connection_damping:freedom=a,to=ground,ratio=0.02'])
def test_derivatives_are_those_of_difference_quotients(text):
    """Of a free structure, whose plant has its modes as states."""
    frame = make_frame(7500, 25.0, DiagnosisSettings(segment_s=20.0, band_bins=1))
    assert_slopes_are_quotients(Simulator(twin(), frame, SECONDS), declared(model())[1], text)


@pytest.mark.parametrize('name', ['connection_friction', 'connection_play'])
def test_friction_and_play_are_between_points_of_one_body(name):
    """A law to the ground would need a spring there; between two masses it has a spectrum."""
    cls = effect_class(name)
    found = list(places(cls, model()))
    assert found == [{'freedom': a, 'to': b} for a, b in zip('abc', 'bcd')]
    assert {'freedom': 'a', 'to': 'ground'} in places(
        effect_class('connection_stiffness'), model())
    starts = {n: v[0] for n, v in cls.starts_on(model(), found[0]).items()}
    frame = make_frame(7500, 25.0, DiagnosisSettings(segment_s=20.0, band_bins=1))
    assert Simulator(model(), frame, SECONDS).expected(
        Candidate((cls(**found[0], **starts),))) is not None
    with pytest.raises(ValueError, match='no spring holds a and ground'):
        inject(model(), [cls(freedom='a', **starts)])


def test_friction_that_sticks_in_a_free_body_is_a_spring():
    """As in a structure that is held; the first 20 s are of how each record begins."""
    amplitude, stiffness = amplitude_between(model(), 'a', 'b')
    assert stiffness == pytest.approx(900.0)
    force = 1e6 * amplitude * stiffness
    stuck, spring, plain = (
        simulate_setup(inject(model(), [parse_effect(t)] if t else [], 60.0), 5).values[500:]
        for t in (f'connection_friction:{INNER},force={force},stiffness_percent=10',
                  f'connection_stiffness:{INNER},share=0.1', ''))
    assert np.std(stuck - spring) < 0.05 * np.std(plain - spring)


def test_a_fit_of_a_free_structure_asks_for_few_spectra(monkeypatch):
    """Slopes come from poles: a spectrum a step, not one for each of the numbers of the model."""
    asked = []
    spectrum = Simulator.spectrum
    monkeypatch.setattr(Simulator, 'spectrum', lambda self, setup: asked.append(1) or spectrum(
        self, setup))
    names, stds = declared(model())
    samples = simulate_setup(inject(twin(), [], SECONDS), 3)
    found = fit_errors(model(), [samples], names, stds, DiagnosisSettings(segment_s=20.0))
    z = (found.values - np.array(twin().calibration.values)) / np.sqrt(np.diag(found.covariance))
    assert np.sqrt(np.mean(z ** 2)) < 1.5
    assert len(asked) < 100         # 432 by quotients


def test_a_free_structure_is_calibrated_and_says_how_far_it_is(tmp_path, monkeypatch):
    """Shares rise from the fit to the end of the check, whose templates have most of them."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    shares, samples = [], simulate_setup(inject(twin(), [], SECONDS), 4)
    found = calibrate(model(), [samples], DiagnosisSettings(segment_s=20.0),
                      progress=shares.append)
    assert found.explains and found.checks[0].after < found.checks[0].before
    assert shares == sorted(shares) and shares[-1] == pytest.approx(1.0)
    assert np.max(np.diff([0.0, *shares])) < 0.2
