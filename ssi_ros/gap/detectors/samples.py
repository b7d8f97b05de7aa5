"""What the samples themselves show: values on a grid of steps, clipped values, missing rows."""
import numpy as np

from ssi_ros.effects.registry import detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.spectra.thresholds import LIMITS as SPECTRA
from ssi_ros.integrity.missing import lost_at_random
from ssi_ros.integrity.thresholds import LIMITS as OF_VALUES
from ssi_ros.integrity.values import limit_of, step_of


@detects('quantisation', of='samples')
def detect_quantisation(effect, samples):
    """Detect a step of which all values of all channels are multiples."""
    steps = []
    for column in samples.values.T:
        steps.append(step_of(column, origin=0.0))
        if not steps[-1]:
            return None
    step = float(np.median(steps))
    return Detection.of_effect(effect(step_m_s2=step), 0.0,
                               f'All values are multiples of {step:.4g} m/s^2.')


@detects('saturation', of='samples')
def detect_clipping(effect, samples):
    """Detect the lowest level at which a channel is clipped, or all channels together."""
    limits = [v for v in map(limit_of, samples.values.T) if v]
    if not limits:
        # few values, on several channels: of unrounded ones no two are equal by chance
        values = np.abs(samples.values[np.isfinite(samples.values)])
        top = values.max()
        if (np.count_nonzero(values == top) < OF_VALUES.ties.value
                or len(np.unique(values)) < OF_VALUES.most_levels.value * len(values)):
            return None
        limits.append(top)
    limit = float(min(limits))
    hits = np.abs(samples.values) >= limit
    share = hits.sum() / np.isfinite(samples.values).sum()
    rows = np.flatnonzero(hits.any(axis=1))
    return Detection.of_effect(
        effect(limit_m_s2=limit), 0.0,
        f'{100 * share:.2g} % of the values are at the clipping limit of {limit:.4g} m/s^2.',
        times=(rows / samples.rate_hz, np.ones(len(rows))))


@detects('dropped_samples', of='samples')
def detect_dropouts(effect, samples):
    """Detect samples of a channel that are missing at random; a gap is no such loss."""
    longest = SPECTRA.gap_s.value * samples.rate_hz
    share = float(np.mean([lost_at_random(m, longest) for m in np.isnan(samples.values).T]))
    if not share:
        return None
    return Detection.of_effect(effect(fraction=share), 0.0,
                               f'{100 * share:.2g} % of the rows are missing at random.')
