"""Any smooth colour of the forces is one effect, whichever law of it a record shows."""
from dataclasses import replace

import pytest
from ssi_ros.effects import inject, parse_effect, places, simulate_setup, with_laws
from ssi_ros.effects.excitation_colour import ExcitationColour
from ssi_ros.effects.excitation_spectrum import ExcitationSpectrum
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT


def test_a_law_belongs_to_its_effect():
    """It is tried with the effect, at all forces together and at each."""
    assert with_laws((ExcitationColour,)) == (ExcitationColour, ExcitationSpectrum)
    assert with_laws((ExcitationSpectrum,)) == (ExcitationSpectrum,)
    craft = load_spacecraft()
    assert [p['force'] for p in places(ExcitationSpectrum, craft)] == [
        'all', 'torque', 'process_noise']
    three = replace(craft, excitation=replace(craft.excitation, torque_rms_n_m=(0.1, 0.1, 0.0)))
    assert [p['force'] for p in places(ExcitationSpectrum, three)][-1] == 'torque_x+torque_y'


def test_a_force_that_is_not_there_is_refused():
    """The message says what was given, and what there is."""
    effect = parse_effect('excitation_spectrum:force=wheel,slope_db=2')
    with pytest.raises(ValueError, match="force 'wheel'.*process_noise"):
        inject(load_spacecraft(), (effect,), 60.0)


def test_a_colour_of_one_force_is_named_with_its_shape():
    """Process noise with 5 dB less at high frequencies, of no corner."""
    craft = replace(load_spacecraft(), uncertainty=EXACT)
    effect = parse_effect('excitation_spectrum:force=process_noise,slope_db=-4,curvature_db=2')
    found = diagnose(craft, simulate_setup(inject(craft, (effect,), 600.0), 8),
                     DiagnosisSettings(), effects=(
                         'excitation_colour', 'sensor_bandwidth', 'damping_scale'))
    assert found.outcome == 'EXPLAINED' and found.verdict['effects'] == ('excitation_colour',)
    assert found.where.site['excitation'] > 0.9
    (best, *_) = found.candidates
    slope = best.parameters['excitation_colour.slope_db']
    assert slope.low90 - 2 * slope.std < -4 < slope.high90 + 2 * slope.std
