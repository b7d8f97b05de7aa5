"""A fault of the data is the answer of a diagnosis, in every form that it has."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.cli.diagnose import text
from ssi_ros.effects import inject, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.model import load_spacecraft
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.uncertainty import EXACT, Uncertainty
from ssi_ros.report.diagnosis_page import diagnosis_markdown, diagnosis_page

SECONDS = 120.0


def reverse(values):
    """Reverse the polarity of the second channel."""
    values[:, 1] *= -1.0


def hold(values):
    """Hold a value of the third channel for 5 s."""
    values[10_000:10_500, 2] = values[10_000, 2]


def in_g(values):
    """Give the fourth channel in g."""
    values[:, 3] /= 9.80665


FAULTS = {reverse: 'the polarity of e1_b is reversed', hold: 'channel e2_a is stuck',
          in_g: 'channel e2_b is in g and not in m/s^2'}


@pytest.mark.parametrize('beside', ['model', 'reference'])
@pytest.mark.parametrize('fault', FAULTS)
def test_a_fault_of_the_data_is_the_answer(beside, fault):
    """Outcome, reason, signs, text, HTML and Markdown name it; the healthy record has none."""
    craft = replace(load_spacecraft(), uncertainty=EXACT)
    reference, healthy = (simulate_setup(inject(craft, (), SECONDS), s) for s in (61, 62))
    nominal = ModelNominal(craft) if beside == 'model' else RecordedNominal(reference)
    values = healthy.values.copy()
    fault(values)
    found = diagnose(nominal, replace(healthy, values=values))
    words = FAULTS[fault]
    assert found.outcome == 'UNEXPLAINED' and found.reason.startswith(words)
    assert found.verdict['effects'] == () and found.candidates[0].effects == ('unknown',)
    assert found.to_json()['signs'] == [found.reason[0].upper() + found.reason[1:] + '.']
    for page in (text(found), diagnosis_page(found), diagnosis_markdown(found)):
        assert words in page


@pytest.mark.parametrize('beside', ['model', 'reference'])
def test_a_healthy_record_has_no_fault(beside):
    """Nothing is wrong with the data of a record that is what the nominal expects."""
    craft = replace(load_spacecraft(), uncertainty=EXACT)
    reference, healthy = (simulate_setup(inject(craft, (), SECONDS), s) for s in (61, 62))
    nominal = ModelNominal(craft) if beside == 'model' else RecordedNominal(reference)
    found = diagnose(nominal, healthy)
    assert found.outcome == 'WITHIN_FLOOR'
    assert not any('channel' in s for s in found.signs)


def test_a_dead_sensor_is_said_with_the_answer():
    """What the others show is within the floor; the headline says that one was left out."""
    craft = replace(load_spacecraft(), uncertainty=EXACT)
    healthy = simulate_setup(inject(craft, (), SECONDS), 64)
    values = healthy.values.copy()
    values[:, 2] = 0.01
    found = diagnose(ModelNominal(craft), replace(healthy, values=values))
    assert found.outcome == 'WITHIN_FLOOR' and 'channels that were compared' in found.reason
    assert 'channel e2_a is dead' in found.reason and 'left out' in found.reason


@pytest.mark.slow
def test_a_scan_is_told_beside_a_model_that_may_be_wrong():
    """Errors of 3 % turn phases as well; what a scan of the channels turns they do not explain."""
    model = replace(load_spacecraft(), uncertainty=Uncertainty(frequency=0.03))
    names, stds = declared(model)
    wrong = replace(model, calibration=Calibration(
        names, stds * np.random.default_rng(4).standard_normal(len(stds))))
    record = simulate_setup(inject(wrong, (), 2 * SECONDS), 63)
    assert diagnose(ModelNominal(model), record).outcome == 'WITHIN_FLOOR'
    f = np.fft.rfftfreq(len(record.values), 1 / record.rate_hz)[:, None]
    turn = np.exp(-2j * np.pi * f * 0.0005 * np.arange(record.values.shape[1]))
    scanned = np.fft.irfft(np.fft.rfft(record.values, axis=0) * turn, len(record.values), axis=0)
    found = diagnose(ModelNominal(model), replace(record, values=scanned))
    assert found.outcome == 'UNEXPLAINED' and 'sampled 0.5' in found.reason
