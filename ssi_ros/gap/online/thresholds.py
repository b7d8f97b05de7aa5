"""Limits of the live meter, each with its unit and its origin."""
from dataclasses import dataclass

from ssi_ros.quantity import choice, Threshold


@dataclass(frozen=True)
class OnlineLimits:
    """Limits of decisions, in the order of the modules that use them."""

    # calibration
    level_share: Threshold = choice(1e-3, '1', 'less of a template beside the levels is rounding')
    # e_detector
    steepest_bet: Threshold = choice(0.5, '1', 'share of the tilt at which eq. (131) has no mean')
    # sliding
    acceleration: Threshold = choice(1e9, 'm/s^2', 'no acceleration; it counts as missing')


LIMITS = OnlineLimits()
