"""Simulate a setup block after block, for a node that publishes while it simulates."""
import math

from ssi_ros.effects.inject import inject
from ssi_ros.effects.simulate import simulate_setup
from ssi_ros.model.simulator import stream
from ssi_ros.records import Samples


def stream_setup(spacecraft, effects, seed, *, duration_s=math.inf, block_s=1.0, at_rest=False,
                 start_ns=0):
    """
    Simulate a spacecraft with effects in blocks; the numbers are those of `simulate_setup`.

    Most effects run without end, equal to rounding. What stretches over the record (sweep,
    drift) needs its length. Drift, hinge laws and moved sampling instants are also computed over
    it: then the record is simulated at the start and handed out in blocks, equal bit for bit.

    Parameters
    ----------
    spacecraft : Spacecraft
        The nominal numbers.
    effects : sequence of Effect
        What to inject; none gives the nominal record.
    seed, at_rest, start_ns
        As in `simulate_setup`.
    duration_s : float
        Length of the record [s], infinity for a stream without end.
    block_s : float
        Length of a block [s].

    Returns
    -------
    channels : tuple of str
        Names of the channels.
    rate_hz : float
        Rate of the stamps [Hz].
    blocks : iterator of Samples
        Blocks of the record; a row that was dropped is NaN.

    Raises
    ------
    ValueError
        If an effect needs the whole record and the stream has no end.

    """
    setup = inject(spacecraft, effects, duration_s)
    if math.isinf(duration_s):
        for e in effects:
            alone = inject(spacecraft, [e], duration_s)
            if stretches(alone) or _computed_whole(alone):
                raise ValueError(f'{e.name} is simulated over the whole record, so the length of '
                                 'the record is needed: set duration_s')
    if _computed_whole(setup):
        samples = simulate_setup(setup, seed, at_rest=at_rest, start_ns=start_ns)
        return samples.channels, samples.rate_hz, _cut(samples, block_s)
    blocks = stream(setup.system, seed, block_s, at_rest=at_rest, rate_hz=setup.system.rate_hz)
    return (setup.system.channels, setup.stamp_rate_hz,
            _stamped(blocks, setup.stamp_rate_hz, start_ns))


def stretches(setup):
    """Return whether a setup's numbers depend on the length of its record."""
    return bool(setup.drift) or any(hasattr(p, 'duration_s') for p in setup.system.excitation)


def _computed_whole(setup):
    return bool(setup.laws or setup.drift or setup.jitter_rms_s or any(setup.delays_s)
                or setup.corners_hz)


def _stamped(blocks, rate_hz, start_ns):
    """Put the stamps' rate, which a wrong clock claims, on blocks of the true one."""
    first = 0
    for block in blocks:
        yield Samples(block.values, rate_hz, block.channels,
                      start_ns + round(first * 1e9 / rate_hz))
        first += len(block.values)


def _cut(samples, block_s):
    count = max(1, round(block_s * samples.rate_hz))
    for first in range(0, len(samples.values), count):
        yield Samples(samples.values[first:first + count], samples.rate_hz, samples.channels,
                      samples.start_ns + round(first * 1e9 / samples.rate_hz))
