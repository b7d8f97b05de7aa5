"""Limits of the detectors, with their origins."""
from dataclasses import dataclass

from ssi_ros.quantity import choice, Threshold


@dataclass(frozen=True)
class DetectorThresholds:
    """Limits of the tests of single effects; those without a module serve several."""

    p_value: Threshold = Threshold(
        0.01, '1', 'engineering choice: weaker detections cannot change an answer that weighs '
        'them against spectra, and each costs a fit')
    # impulses
    least_peak: Threshold = choice(3.3, 'standard deviations', 'lower peaks of noise are too many')
    # chirp
    least_cycles: Threshold = Threshold(
        3.0, '1', 'a change of frequency times duration below it cannot be resolved from a line')
    # amplitude modulation
    least_periods: Threshold = Threshold(
        0.7, 'periods', 'simulation: python -m validation.gap_swings; fewer are hardly '
        'different from a change of level')
    fastest_hz: Threshold = Threshold(
        1.0, 'Hz', 'engineering choice: faster modulation is a pair of lines beside each mode')
    likelier: Threshold = Threshold(
        4.0, 'nats', 'simulation: python -m validation.gap_swings; gain of a level that varies by '
        'chance over a steady one')
    # low-frequency noise
    drift_fastest_hz: Threshold = choice(1.0, 'Hz', 'beyond it the fitted band holds the noise')
    drift_trials: Threshold = Threshold(
        2.5, '1', 'simulation: independent time constants of the grid')


LIMITS = DetectorThresholds()
