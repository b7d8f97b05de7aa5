"""Limits of the integrity of data, with their origins."""
from dataclasses import dataclass

from ssi_ros.quantity import Threshold


@dataclass(frozen=True)
class IntegrityThresholds:
    """Limits in the order of the modules that use them."""

    # values
    most_levels: Threshold = Threshold(
        0.5, '1', 'engineering choice: distinct values over samples; continuous noise has 1')
    step_error: Threshold = Threshold(
        0.01, 'steps', 'engineering choice: rounding of decimal numbers in a file is below it')
    ties: Threshold = Threshold(
        3, 'samples', 'of continuous noise no two samples are equal; a resend may copy one')
    rounded_share: Threshold = Threshold(
        5e-3, '1', 'engineering choice: of rounded values at the extreme; hardware repeats some')
    rounded_ratio: Threshold = Threshold(
        5.0, '1', 'engineering choice: over the next value; a Gaussian tail has less than 1')
    # repeats
    stuck_samples: Threshold = Threshold(
        10, 'samples', 'engineering choice: no two samples of continuous noise are equal')
    repeated_share: Threshold = Threshold(
        1e-3, '1', 'engineering choice: fewer resends change no answer')
    # wiring
    least_p: Threshold = Threshold(
        1e-6, '1', 'engineering choice: rare faults that are large where they are')
    unit_error: Threshold = Threshold(
        0.3, 'log amplitude', 'engineering choice: no calibration is off by a factor of 7; other '
        'levels of several inputs change the ratio of two channels by 20 %')
    unit_spread: Threshold = Threshold(
        1.0, 'log amplitude', 'simulation: the middle 80 % of bins of records in g span 0.5, of a '
        'colour of the excitation that is as quiet 1.6 and more')
    tied: Threshold = Threshold(
        10.0, 'nats', 'engineering choice: less of a likelihood ratio does not decide')
    unexplained: Threshold = Threshold(
        0.5, '1', 'engineering choice: share of the gap that an arrangement may leave, as beside '
        'another effect')
    other_levels: Threshold = Threshold(
        0.05, 'nats', 'simulation: levels of 6 dB more or less change D by 0.03 at most')
    least_share: Threshold = Threshold(
        0.15, '1', 'engineering choice: share of the gap that a skew explains at least; a damper '
        'makes phases that are near a slope, and little else of it')
    one_slope: Threshold = Threshold(
        0.5, '1', 'engineering choice: weighted mean of the cosines of phases around one delay a '
        'pair; 1 where the delays are all')
    uneven: Threshold = Threshold(
        0.1, '1', 'engineering choice: share of the gain of free delays that even steps may lack')


LIMITS = IntegrityThresholds()
