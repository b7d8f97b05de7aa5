"""Tests in time of a long record are those of its blocks, in times and phases of the record."""
from dataclasses import replace
import math

import numpy as np
import pytest
from ssi_ros.effects import effect_class, inject, parse_effect, simulate_setup
from ssi_ros.events import blocks
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.records import Samples

SECONDS, NAMES = 400.0, ('harmonic_disturbance', 'wheel_speed_sweep', 'nonstationary_excitation')


def searched(text, longest_s, monkeypatch):
    """Return the detections in a record of SECONDS with an effect, in blocks of a length."""
    monkeypatch.setattr(blocks, 'LONGEST_S', longest_s)
    samples = simulate_setup(inject(load_spacecraft(), [parse_effect(text)], SECONDS), 5)
    model = replace(load_spacecraft(), uncertainty=EXACT)
    _, simulator, record, levels = ModelNominal(model).ready(samples, DiagnosisSettings())
    found, _ = blocks.search(simulator, fit(simulator, record.spectra, levels=levels),
                             record.samples, DiagnosisSettings(), NAMES)
    return {d.effect: d for d in found}


def test_blocks_cover_a_record_without_what_is_missing():
    """All rows are in a block, blocks are equally long, one without samples is left out."""
    samples = Samples(np.zeros((720_001, 1)), 100.0, ('a',))
    parts = list(blocks.blocks(samples))
    assert len(parts) == 5 and len({len(p.values) for _, p, _ in parts}) == 1
    begins = [round(at * 100) for at, _, _ in parts]
    assert begins[0] == 0 and begins[-1] + len(parts[-1][1].values) == 720_001
    assert all(b - a <= len(parts[0][1].values) for a, b in zip(begins, begins[1:]))
    missing = np.zeros(720_001, bool)
    missing[:150_000] = True
    assert len(list(blocks.blocks(samples, missing))) == 4


@pytest.mark.parametrize('text, expected, tolerance', [
    # a line is where it is in every block; half a bin of a block of 200 s
    ('harmonic_disturbance:frequency_hz=12.3,torque_n_m=0.3', {'frequency_hz': 12.3}, 0.003),
    # the ends of a sweep are those of the record; each is known to about a bin
    ('wheel_speed_sweep:start_hz=8,end_hz=20,torque_n_m=0.3', {'start_hz': 8, 'end_hz': 20}, 0.05),
])
def test_effects_of_a_block_are_those_of_the_record(text, expected, tolerance, monkeypatch):
    """What one of two blocks shows is given as an effect of the whole record."""
    found = searched(text, 200.0, monkeypatch)[text.partition(':')[0]]
    assert found.p_value < 1e-6 and ' s).' in found.text
    for name, value in expected.items():
        assert found.parameters[name] == pytest.approx(value, abs=tolerance)
        assert getattr(found.basis, name) == found.parameters[name]


def test_the_phase_of_a_modulation_is_that_at_the_first_sample():
    """A modulation of a later block goes back to the begin of the record."""
    of_block = effect_class('nonstationary_excitation')(depth=0.2, period_s=60.0, phase_rad=1.0)
    whole = of_block.in_record(100.0, 200.0, 400.0)
    assert math.sin(2 * math.pi * 100 / 60 + whole.phase_rad) == pytest.approx(math.sin(1.0))


def test_the_least_p_value_counts_by_the_number_of_blocks():
    """One minus (1 - p)^n, and the instants of every block in the time of the record."""
    cls = effect_class('impulsive_events')
    times = np.array([1.0]), np.ones(1)
    made = [(at, (Detection.of_effect(cls(rate_per_min=6.0, impulse_n_m_s=0.1), p, 'Text.',
                                      times=times),))
            for at, p in ((0.0, 0.01), (1800.0, 0.001), (3600.0, 0.005))]
    found, = blocks._joined(made, 1800.0, 5400.0)
    assert found.p_value == pytest.approx(1 - 0.999 ** 3)
    assert list(found.times[0]) == [1.0, 1801.0, 3601.0]
