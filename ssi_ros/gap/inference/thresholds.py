"""Limits of the inference, each with its unit and its origin."""
from dataclasses import dataclass

from ssi_ros.quantity import choice, Threshold


@dataclass(frozen=True)
class InferenceLimits:
    """Limits of decisions and widths of priors, in the order of the modules that use them."""

    # recorded_fit
    smoothing: Threshold = choice(30.0, 'nat', 'error of D where predictions differ in smoothness')
    level_range: Threshold = choice(1.5, 'log power', 'level around the median ratio of the bands')
    noise_loss: Threshold = Threshold(
        0.9, '1', 'engineering choice: share of the noise floor that may vanish as a nuisance')
    noise_growth: Threshold = choice(9.0, '1', 'floors that the noise may gain, 10 dB in all')
    least_scatter: Threshold = choice(0.05, '1', 'least share of a prediction that scatters')
    most_scatter: Threshold = choice(1.5, '1', 'most of it, where added power is negative')
    # unmodelled
    distinct_modes: Threshold = Threshold(
        1e-3, '1', 'engineering choice: a smaller eigenvalue of correlations is rounding')
    slow_decay: Threshold = Threshold(
        8.0, '1', 'exp(-8) = 3e-4 of an amplitude remains: python -m validation.gap_scatter')
    # score_scatter
    short_segment: Threshold = Threshold(
        0.9, '1', 'simulation: python -m validation.gap_missing short; of the usual length')
    leakage: Threshold = Threshold(
        0.1, '1', 'simulation: a model of five channels and three inputs has 0.36, others 0.01')
    # parametric_bootstrap
    pooled_records: Threshold = Threshold(
        3.0, '1', 'engineering choice: weight of the variance of all scores, beside five records')
    asked_again: Threshold = choice(0.05, '1', 'p-value of an anomaly that is simulated')
    # indirect_inference
    estimate_std: Threshold = Threshold(
        1.5, 'std', 'two of the standard deviation of a mean of two records, sqrt(1 / 2)')
    estimate_level: Threshold = choice(0.05, '1', 'share of a level, 0.2 dB')
    # probable_errors
    corrected_std: Threshold = Threshold(
        4.0, 'std', 'engineering choice: how far an uncertain number may go from the model')
    # levels of a model
    excitation_std: Threshold = choice(1.4, 'log power', 'excitation known to 6 dB')
    noise_std: Threshold = choice(0.7, 'log power', 'sensor noise known to 3 dB')
    excitation_db: Threshold = Threshold(
        30.0, 'dB', 'engineering choice: a wrong unit is likelier than five prior deviations')
    quiet_db: Threshold = Threshold(
        -12.0, 'dB', 'g for m/s^2 lowers all power by 20 dB; half of it in decades')
    noise_db: Threshold = Threshold(
        35.0, 'dB', 'clipping and sampling jitter raise the noise by up to 26 dB')


LIMITS = InferenceLimits()
