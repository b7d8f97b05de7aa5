"""Limits of recorded inputs, each with its unit and its origin."""
from dataclasses import dataclass

from ssi_ros.gap.settings import Threshold


@dataclass(frozen=True)
class InputLimits:
    """Limits of what is taken for a recorded input of a record."""

    missing: Threshold = Threshold(
        0.05, '1', 'engineering choice: share of the rows of an input that the channels fill')
    coherent: Threshold = Threshold(
        0.5, '1', 'engineering choice: share of the power of the channels that follows an input, '
        'from which its factor is judged')
    factor: Threshold = Threshold(
        2.0, '1', 'engineering choice: a factor beyond is a unit, not a gap of the structure')
    hold: Threshold = Threshold(
        1.5, 'rows', 'engineering choice: an input that is silent for longer is missing')


LIMITS = InputLimits()
