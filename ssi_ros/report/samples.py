"""From a bag's channels, each with its own stamps, to samples on one even grid."""
import numpy as np

from ssi_ros.identify.grid import Grid
from ssi_ros.records import Samples


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
        Without samples, or if the clock jumps in the record.

    """
    grid = Grid(recording.names, rate_hz)
    for i, (stamps, values) in enumerate(zip(recording.stamps_ns, recording.values)):
        grid.push(i, stamps, values)
    rows = grid.rows(flush=True)
    if not rows:
        raise ValueError('the bag has no samples on these channels')
    if len({r.segment for r in rows}) > 1:
        raise ValueError('the clock of the bag jumps; cut the bag there and give one part')
    return Samples(np.concatenate([r.values for r in rows]), rows[0].rate_hz, recording.names,
                   rows[0].origin_ns)
