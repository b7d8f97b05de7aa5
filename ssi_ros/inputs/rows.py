"""From the stamps of an input, held from each message to the next, to the rows of a record."""
import numpy as np

from ssi_ros.inputs.thresholds import LIMITS


def in_rows(stamps_ns, values, record):
    """
    Return the mean of an input over every row of a record.

    Parameters
    ----------
    stamps_ns : ndarray of int, shape (n,)
        When each value began to act [ns], in any order.
    values : ndarray, shape (n,)
        The input.
    record : Samples
        The rows.

    Returns
    -------
    ndarray, shape (rows,)
        NaN where no value is known.

    Raises
    ------
    ValueError
        If there are fewer than two values, or none within the record.

    """
    kept = np.isfinite(values)
    stamps, first = np.unique(np.asarray(stamps_ns)[kept], return_index=True)
    values = np.asarray(values, float)[kept][first]
    if len(stamps) < 2:
        raise ValueError(f'has {len(stamps)} values with stamps of their own; a record needs more')
    # seconds since the record began keep their digits
    at = (stamps - record.start_ns) * 1e-9
    period = 1 / record.rate_hz
    begins = np.arange(len(record.values)) * period
    step = float(np.median(np.diff(at)))
    last = at[-1] + step
    if at[0] >= begins[-1] or last <= 0.0:
        raise ValueError(f'was recorded from {at[0]:.4g} to {at[-1]:.4g} s of a record of '
                         f'{record.duration_s:.4g} s: they do not overlap')
    edges, held = np.append(at, last), np.append(0.0, np.cumsum(values * np.diff(
        np.append(at, last))))
    through = np.interp(np.append(begins, begins[-1] + period), edges, held)
    out = np.diff(through) / period
    near = 1e-3 * period                # stamps are rounded
    out[(begins < at[0] - near) | (begins + period > last + near)] = np.nan
    for gap in np.flatnonzero(np.diff(at) > LIMITS.hold.value * step):
        out[(begins + period > at[gap] + step + near) & (begins < at[gap + 1] - near)] = np.nan
    return out
