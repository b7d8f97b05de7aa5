"""Limits of the recorded nominal, each with its unit and its origin."""
from dataclasses import dataclass

from ssi_ros.quantity import choice, Threshold


@dataclass(frozen=True)
class NominalLimits:
    """Limits of decisions, in the order of the folders that use them."""

    # model
    wrong_model: Threshold = choice(
        500.0, 'nat', 'an effect of 32 deviations; frequencies off by 0.3 % lose more')
    # detections of stationary/ and periodic/
    detected: Threshold = choice(
        1e-3, '1', 'with about ten tests of a pair of recordings one false detection in a hundred')
    least_depth: Threshold = choice(
        0.02, '1', 'a level that varies by less than 2 % changes power by 4 %, as a drive does')
    deeper: Threshold = choice(
        2.0, '1', 'modulation over that of the reference, from which they differ')
    pulse: Threshold = Threshold(5.0, 'sd', 'Gaussian: one of 1.7 million samples is beyond it')
    fewest_pulses: Threshold = choice(3, '1', 'two may be one disturbance of the recording')
    sweep_correlation: Threshold = choice(
        3.0, 'sd', 'three standard deviations of a sample correlation')
    steep: Threshold = choice(
        8.0, '1', 'power of a line over the bins beside it; a skirt rises evenly')
    stronger: Threshold = choice(
        2.0, '1', 'a sweep over the best of the reference, in standard deviations')
    clock_ppm: Threshold = choice(50.0, '1e-6', 'two crystals of 25 ppm each')
    clock_deviations: Threshold = choice(
        6.0, 'sd', 'the spread of a period is known from few lines')
    same_signal: Threshold = choice(
        0.8, '1', 'correlation of mean periods; another signal has about 0')
    repeats: Threshold = choice(0.5, '1', 'share of the power that repeats: the larger half')
    negligible_noise: Threshold = choice(
        0.01, '1', 'of the rms, -40 dB; deeper noise differs from hour to hour')
    present: Threshold = choice(
        1 / 3, '1', 'share of the samples of a channel, below which bridges dominate')
    # weight of the bands of a reference, eq. (143)
    usual_scatter: Threshold = choice(
        1.3, '1', 'scatter of power over that of Gaussian noise by chance, from 24 groups')
    random_walk: Threshold = Threshold(
        2.0, '1', 'random walk: its variance between two recordings over that of two halves of '
        'one')
    halves_of_reference: Threshold = choice(
        2.0, 'sd', 'difference of the halves of a reference that chance makes')
    # modes
    same_mode: Threshold = Threshold(
        0.9, '1', 'MAC of one mode in two tests: Ewins, Modal Testing, 2000')
    like_mode: Threshold = choice(0.5, '1', 'MAC of a neighbour that a mode could be taken for')
    mode_odds: Threshold = choice(100.0, 'nat', 'spreads of modes are not believed further')
    certain_shift: Threshold = choice(
        1e-6, '1', 'chance of a mode that moved, five standard deviations, which a fit must move')
    clear_shift: Threshold = choice(
        1e-4, '1', 'chance of a mode that moved, which is no floor where no fit moves it')
    # joints, eq. (154) to (157)
    phase_locked: Threshold = choice(
        5.0, 'sd', 'bursts that follow the phase of a mode, over their surrogates')
    other_level: Threshold = choice(0.2, 'log power', '0.9 dB, the stability of a drive')
    distortion: Threshold = choice(
        1e-3, '1', 'share of the power of a channel; less changes no mode')
    mostly_distortion: Threshold = choice(
        4.0, '1', 'power over the level, beyond which no mode of the reference explains it')
    # candidates
    certain_odds: Threshold = choice(
        30.0, 'nat', 'odds of one statistic are not believed further')
    detection_odds: Threshold = choice(
        100.0, 'nat', 'p-values of detections are not believed further')
    exact_odds: Threshold = Threshold(
        1e6, 'nat', 'what is read off the samples is certain: no fit outweighs it')
    modal_form: Threshold = choice(
        0.1, '1', 'share of the gap that a modal form may leave, being approximate')
    linearised_form: Threshold = choice(
        0.5, '1', 'the same of the linear form of what is not Gaussian')
    size_range: Threshold = choice(
        6.0, 'nat', 'an unknown size lies within a factor of 400 to both sides, eq. (112)')
    clear_level: Threshold = choice(
        2.0, 'sd', 'a level that is significant at two standard deviations')
    far: Threshold = choice(
        6.0, 'sd', 'gap above which modes and sizes may be far from every start')
    gross: Threshold = choice(
        30.0, 'sd', 'gap above which slopes of the likelihood mean little, eq. (151)')
    inside: Threshold = Threshold(
        3.0, 'sd', 'gap that counts as its floor: three standard deviations')


LIMITS = NominalLimits()
