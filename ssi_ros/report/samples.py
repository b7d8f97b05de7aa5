"""From a bag's channels, each with its own stamps, to samples on one even grid."""
import numpy as np

from ssi_ros.identify.grid import Grid
from ssi_ros.identify.stamps import batches, nothing_on
from ssi_ros.records import Samples

TOGETHER_NS = 300_000_000_000       # of all channels, well below the gap of a new segment


def samples_of(recording, rate_hz=0.0):
    """
    Bring the channels of a recording onto one even grid; a missing sample is NaN.

    Parameters
    ----------
    recording : Recording
        Of `bag.read_channels`.
    rate_hz : float
        Sampling rate [Hz]; 0 estimates it from the stamps.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError
        Without samples, if they come at another rate than the one given, or if the clock jumps
        in the record.

    """
    if rate_hz:
        _check_rate(recording, rate_hz)
    grid = Grid(recording.names, rate_hz)
    # as they came: a whole channel before the next would seem to turn the clock back
    for parts in batches(recording.arrivals_ns, TOGETHER_NS):
        for i, part in enumerate(parts):
            grid.push(i, recording.stamps_ns[i][part], recording.values[i][part])
    rows = grid.rows(flush=True)
    if not rows:
        raise ValueError(nothing_on(grid))
    if len({r.segment for r in rows}) > 1:
        raise ValueError('the clock of the bag jumps; cut the bag there and give one end')
    return Samples(np.concatenate([r.values for r in rows]), rows[0].rate_hz, recording.names,
                   rows[0].origin_ns)


def _check_rate(recording, rate_hz):
    for name, stamps in zip(recording.names, recording.stamps_ns):
        steps = np.diff(stamps) * 1e-9
        if len(steps) < 2 or np.median(steps) <= 0.0:
            continue
        # however many samples are lost, some steps are single ones; too slow: none is
        if np.quantile(steps, 0.01) > 1.5 / rate_hz or np.mean(steps) < 0.67 / rate_hz:
            raise ValueError(
                f'{name} comes at {1.0 / np.median(steps):.4g} Hz, not at the {rate_hz:g} Hz '
                'asked for; set rate_hz to its rate, in the spacecraft YAML if there is a model')
