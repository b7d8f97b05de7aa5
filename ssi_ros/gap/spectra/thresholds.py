"""Limits of the spectra, each with its unit and its origin."""
from dataclasses import dataclass

from ssi_ros.quantity import choice, Threshold


@dataclass(frozen=True)
class SpectraLimits:
    """Limits of decisions, in the order of the modules that use them."""

    # band_averages
    present: Threshold = Threshold(
        0.25, '1', 'engineering choice: share of a segment that is recorded, below which it is '
        'not used')
    silent: Threshold = choice(1e-3, '1', 'share of power in the silent bands, eq. (144)')
    # imputation
    gap_s: Threshold = choice(1.0, 's', 'longest time that samples are lost at random or clipped')
    filled_s: Threshold = Threshold(
        3.0, 's', 'longest gap that is filled: python -m validation.gap_missing effects')
    level_change: Threshold = choice(0.01, 'log power', '0.04 dB between two rounds of filling')


LIMITS = SpectraLimits()
