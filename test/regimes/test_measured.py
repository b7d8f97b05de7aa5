"""Measured records of which it is known what distinguishes them; skipped where they are not."""
import os
from pathlib import Path

import numpy as np
import pytest
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.records import Samples

FOLDER = Path(os.environ.get('SSI_ROS_DATA', '../shared/data'))
pytestmark = pytest.mark.skipif(not (FOLDER / 'pcb_shock.npz').exists(),
                                reason='measured records are not at hand')


def test_a_beam_on_another_support_is_another_structure():
    """Roller at 2.09 V and at 1.65 V, each for 0.7 s: 31 Hz and 28 Hz; nothing is named."""
    data = np.load(FOLDER / 'dropbear_slow10_0.npz')
    values = np.column_stack([data['low_g_accel'], data['accel']]).astype(float)
    both = Samples(values, 5000.0, ('low_g_accel', 'accel'))
    found = diagnose(RecordedNominal(both.between(9.3, 10.0)), both.between(10.5, 11.2))
    assert not found.verdict['effects']
    assert found.outcome == 'UNEXPLAINED' and found.where.site['structure'] == 1.0


def test_a_shock_on_a_vibrating_board_is_an_event_of_the_excitation():
    """Whatever else differs between two runs, its time is said and nothing but it is named."""
    data = np.load(FOLDER / 'pcb_shock.npz')
    quiet, shock = (Samples(data[f'shock_{s}_vibration_0.3'].astype(float), 1 / 0.000586,
                            ('base', 'board')) for s in ('0.0', '0.3'))
    found = diagnose(RecordedNominal(quiet), shock)
    assert set(found.verdict['effects']) <= {'impulsive_events'}
    assert max(found.where.site, key=found.where.site.get) == 'excitation'
    assert any('event at 3.8' in s for s in found.signs)


def test_parts_of_one_loud_recording_are_alike():
    """Halves of level 5 of the F-16, whose distortion varies, turned round."""
    data = np.load(FOLDER / 'f16_level5.npz')
    whole = Samples(data['acceleration'].astype(float), 400.0, ('shaker', 'wing', 'payload'))
    halves = whole.between(0, 92.16), whole.between(92.16, 184.32)
    assert diagnose(RecordedNominal(halves[1]), halves[0]).outcome == 'WITHIN_FLOOR'
