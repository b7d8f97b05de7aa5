"""Values of one channel: steps of rounding, clipping limits."""
import numpy as np

from ssi_ros.integrity.thresholds import LIMITS

SMALLEST = 1e-6         # of the largest difference of neighbours: a smaller one is of rounding
ONE_STEP = 1.5          # steps, up to which a difference is one step
EQUAL = 1e-9            # relative difference of values that are one, after a change of unit
NEAR = 0.99             # of the extreme, from which on coarse values are its neighbours


def step_of(column, origin=None):
    """
    Return the step of which all values of a channel (n,) are multiples, 0 where there is none.

    NaN is a missing sample; the steps begin at `origin`, or anywhere if it is None.
    """
    column = column[np.isfinite(column)]
    values = np.unique(column)
    inner = values[1:-1]                       # clipping limits need not be multiples
    if len(inner) < 3 or len(values) > LIMITS.most_levels.value * len(column):
        return 0.0
    differences = np.diff(inner)
    step = differences[differences > SMALLEST * differences.max()].min()
    step = np.median(differences[differences < ONE_STEP * step])
    step = (inner[-1] - inner[0]) / np.rint((inner[-1] - inner[0]) / step)
    phase = (inner - (inner[0] if origin is None else origin)) / step
    return float(step) if np.abs(phase - np.rint(phase)).max() < LIMITS.step_error.value else 0.0


def limit_of(column):
    """Return the level at which a channel (n,), NaN where missing, is clipped; 0 if it is not."""
    size = np.abs(column[np.isfinite(column)])
    top = size.max(initial=0.0)
    hits = np.count_nonzero(size >= top * (1 - EQUAL))
    if hits < LIMITS.ties.value or top == 0.0:
        return 0.0
    if len(np.unique(column)) > LIMITS.most_levels.value * len(size):
        return float(top)
    # rounded values repeat themselves: a limit turns a tail that falls into one that rises
    step = step_of(column)
    near = np.count_nonzero(size > (top - ONE_STEP * step if step else NEAR * top)) - hits
    rises = hits > LIMITS.rounded_ratio.value * (near + 1)
    return float(top) if rises or (
        step and hits > near and hits > LIMITS.rounded_share.value * len(size)) else 0.0
