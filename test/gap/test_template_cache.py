"""Templates on disk: the same after reading, never those of another model, never half a file."""
from dataclasses import replace

import numpy as np
import pytest

from ssi_ros.effects import parse_effect
from ssi_ros.gap.inference.score_test import make_templates
from ssi_ros.gap.inference.unmodelled.templates import make_change_templates
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.model.errors import Calibration
from ssi_ros.template_cache import (
    effect_templates, folder, load_changes, load_templates, save_changes, save_templates,
    templates_key)
from ssi_ros.updating.adapt import standing
from ssi_ros.updating.prior import prior_of

EFFECTS = [parse_effect('sensor_gain:channel=e1_a,scale=1.002'),
           parse_effect('stiffness_drift:change=0.005')]


@pytest.fixture
def templates(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    frame = make_frame(6000, 100.0, DiagnosisSettings())
    return make_templates(Simulator(load_spacecraft(), frame, 60.0), EFFECTS)


def test_round_trip(templates):
    """What is read is what was written, effects and modulation too."""
    key = templates_key(load_spacecraft(), 6000, names=('sensor_gain',))
    assert load_templates(key, EFFECTS) is None
    save_templates(key, templates, EFFECTS)
    again = load_templates(key, EFFECTS)
    assert again.effects == templates.effects and again.level == templates.level
    assert np.array_equal(again.white.vectors, templates.white.vectors)
    assert np.array_equal(again.white.factor, templates.white.factor)
    assert np.array_equal(again.modulation[1], templates.modulation[1])


def test_the_key_knows_the_model():
    """Another stiffness or length has another key."""
    craft = load_spacecraft()
    other = replace(craft, noise_rms_m_s2=4e-4)
    assert len({templates_key(craft, 6000), templates_key(other, 6000),
                templates_key(craft, 6001)}) == 3


def test_half_a_file_is_made_anew_and_old_ones_go(templates):
    """A cut file reads as none; only the newest few stay."""
    for i in range(7):
        save_templates(f'templates-{i}.npz', templates, EFFECTS)
    assert len(list(folder().glob('*'))) == 4
    path = folder() / 'templates-6.npz'
    path.write_bytes(path.read_bytes()[:1000])
    assert load_templates('templates-6.npz', EFFECTS) is None


def test_a_folder_that_cannot_be_written_is_left_alone(templates, tmp_path, monkeypatch):
    """No cache, no error."""
    (tmp_path / 'file').write_text('')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'file'))
    save_templates('templates-x.npz', templates, EFFECTS)
    assert load_templates('templates-x.npz', EFFECTS) is None


def test_changes_that_no_effect_makes_are_kept_too(tmp_path, monkeypatch):
    """What is read is what was made: words, numbers, also infinite ones, and spectra."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    frame = make_frame(6000, 100.0, DiagnosisSettings())
    made = make_change_templates(Simulator(load_spacecraft(), frame, 60.0))
    assert load_changes('changes-x.npz') is None
    save_changes('changes-x.npz', made)
    again = load_changes('changes-x.npz')
    for one, two in ((made.constant, again.constant), (made.drifting, again.drifting)):
        assert one.effects == two.effects and one.level == two.level
        assert np.array_equal(one.white.vectors, two.white.vectors)
        assert np.array_equal(one.white.runs.edges, two.white.runs.edges)


def test_a_calibrated_model_has_the_templates_of_its_calibration(tmp_path, monkeypatch):
    """Forces of one recording, and what is written beside the errors, make no others."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    craft, settings = load_spacecraft(), DiagnosisSettings()
    frame = make_frame(6000, 100.0, settings)
    errors = Calibration(('frequency E1 1', 'force E1 1'), (0.01, 0.3), ((1e-6, 0), (0, 0.1)))
    shared = [effect_templates(
        Simulator(replace(craft, calibration=c), frame, 60.0), settings, ('sensor_gain',), None)
        for c in (errors, replace(errors, values=(0.01, 0.0), unexplained=('a line',)))]
    other = effect_templates(Simulator(replace(craft, calibration=replace(
        errors, values=(0.02, 0.3))), frame, 60.0), settings, ('sensor_gain',), None)
    assert shared[0].white is shared[1].white is not other.white
    assert len(list(folder().glob('*'))) == 2


def test_templates_beside_declared_errors_are_kept_with_their_shifts(tmp_path, monkeypatch):
    """Before any record; `identifiability` asks for the same again and again."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    craft, settings = load_spacecraft(), DiagnosisSettings()
    side = standing(Simulator(craft, make_frame(6000, 100.0, settings), 60.0), prior_of(craft))
    made = effect_templates(side, settings, ('hub_inertia',), None)
    monkeypatch.setattr('ssi_ros.template_cache._IN_MEMORY', {})
    read = effect_templates(side, settings, ('hub_inertia',), None)
    assert read is not made and np.any(made.shifts)
    assert np.array_equal(read.shifts, made.shifts)
    assert np.array_equal(read.white.vectors, made.white.vectors)
