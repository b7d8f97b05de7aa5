"""Limits of the regimes of motion, each with its unit and its origin."""
from dataclasses import dataclass

from ssi_ros.quantity import choice, Threshold


@dataclass(frozen=True)
class RegimeLimits:
    """Limits of decisions, in the order of the files that use them."""

    clear_line: Threshold = choice(
        100.0, '1', 'power of a line over its scatter: a tenth of an amplitude')
    certain: Threshold = choice(
        1e-3, '1', 'beyond doubt from the scatter of a handful of periods')
    changed: Threshold = choice(
        0.02, '1', 'rms change of a ratio of channels: the stability of a mounting')
    # excess.py
    distortion: Threshold = choice(
        1e-3, '1', 'share of the power of a channel; less changes no mode')
    # carrier
    same_carrier: Threshold = choice(
        0.05, '1', 'relative difference of the periods of two recordings of one drive')
    steady_db: Threshold = choice(
        1.0, 'dB', 'by which the level of a drive changes through a recording at most')
    other_level_db: Threshold = choice(0.9, 'dB', 'the stability of a drive')
    # decays.py
    dies_away: Threshold = choice(
        10.0, 'dB', 'from the first to the last eighth of a recording: a mean is of its beginning')
    steadily: Threshold = choice(
        0.9, '1', 'share of the variance of the level that a straight line explains')
    most: Threshold = choice(0.5, '1', 'share of the power of a channel: the larger half')
    stands_out: Threshold = choice(
        10.0, '1', 'amplitude over the median of a channel, that has a phase')
    same_shape: Threshold = Threshold(
        0.9, '1', 'MAC of one mode in two tests: Ewins, Modal Testing, 2000')
    same_mode: Threshold = choice(
        0.3, '1', 'relative change of a frequency, beyond which it may be another mode')


LIMITS = RegimeLimits()
