"""Limits of the live meter, each with its unit and its origin."""
from dataclasses import dataclass

from ssi_ros.gap.settings import Threshold


@dataclass(frozen=True)
class OnlineLimits:
    """Limits of decisions, in the order of the modules that use them."""

    # calibration
    level_share: Threshold = Threshold(
        1e-3, '1', 'engineering choice: less of a template beside the levels is rounding')
    # e_detector
    steepest_bet: Threshold = Threshold(
        0.5, '1', 'engineering choice: share of the tilt at which eq. (131) has no mean')
    # sliding
    acceleration: Threshold = Threshold(
        1e9, 'm/s^2', 'engineering choice: no acceleration; it counts as missing')


LIMITS = OnlineLimits()
