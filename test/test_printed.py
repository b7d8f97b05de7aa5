"""Numbers as text: standard deviations of two digits, no '-0.00', reasons of one line."""
import math

import numpy as np
import pytest
from ssi_ros.identify.bands import Band
from ssi_ros.identify.excitation import why_lost
from ssi_ros.quantity import fixed, p_equation, with_spread
from ssi_ros.records import Mode


@pytest.mark.parametrize('value, std, text', [
    (15.82712, 0.00641, '15.8271 +- 0.0064'), (0.4912, 0.193, '0.49 +- 0.19'),
    (1.2345, 0.0996, '1.23 +- 0.10'), (123.4, 21.4, '123 +- 21'),
    (-0.0004, 0.019, '0.000 +- 0.019'),
    (2.5, math.nan, '2.50'), (2.5, math.inf, '2.50'), (2.5, 0.0, '2.50')])
def test_a_standard_deviation_has_two_digits(value, std, text):
    """The number has the decimals of its standard deviation, or stands alone."""
    assert with_spread(value, std, 2) == text


def test_no_negative_zero_and_no_nan():
    """What rounds to zero has no minus; what is no number is a dash."""
    assert fixed(-0.001, 2) == '0.00' and fixed(-0.001, 2, '+') == '+0.00'
    assert fixed(-0.02, 2) == '-0.02' and fixed(math.nan, 2) == '-'


def test_a_reason_is_one_line():
    """Seventeen modes that the excitation left are counted; two are named."""
    modes = [Mode(1.0 + k, 0.005, [1.0], identity=k) for k in range(17)]
    heard, powers = dict.fromkeys(range(17), 1.0), [np.full(4, 1e-3)]
    bands = (Band(100.0, 0.1, 49.0, 1),)
    said = why_lost(heard, modes, powers, bands)
    assert '17 modes from 1.000 to 17.000 Hz' in said and len(said) < 200
    assert 'mode 0 (1.000 Hz), 1 (2.000 Hz)' in why_lost(heard, modes[:2], powers, bands)


def test_a_p_value_in_a_sentence():
    """Two digits, or below what arithmetic can say."""
    assert (p_equation(0.0213), p_equation(0.0)) == ('p = 0.021', 'p < 1e-15')
