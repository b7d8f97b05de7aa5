"""Setups in blocks: what the simulator node publishes is the offline record."""
import math

import numpy as np
import pytest
from ssi_ros.effects import applicable, inject, library, parse_effect, simulate_setup
from ssi_ros.effects.stream import stream_setup
from ssi_ros.model import assemble, load_spacecraft, simulate

SECONDS = 6.3
WHOLE = {'wheel_speed_sweep', 'stiffness_drift', 'hinge_freeplay', 'hinge_friction',
         'cubic_stiffness', 'channel_delay', 'sensor_bandwidth', 'timestamp_jitter'}


def started(name):
    """Return the effect at its first starting values."""
    cls = library()[name]
    return cls(**{key: values[0] for key, values in cls.starts.items()})


@pytest.fixture(scope='module')
def spacecraft():
    return load_spacecraft()


def joined(spacecraft, effects, **options):
    """Return stamps and values of all blocks of a stream of SECONDS."""
    _, rate_hz, blocks = stream_setup(spacecraft, effects, 4, start_ns=10 ** 18, **options)
    stamps, values = [], []
    while sum(map(len, stamps)) < round(SECONDS * rate_hz):
        block = next(blocks)
        stamps.append(block.stamps_ns())
        values.append(block.values)
    count = round(SECONDS * rate_hz)
    return np.concatenate(stamps)[:count], np.concatenate(values)[:count]


@pytest.mark.parametrize('name', applicable(None))
def test_blocks_are_the_record(name, spacecraft):
    """Every effect, with the record's length given: the offline samples on the offline stamps."""
    effect = started(name)
    stamps, values = joined(spacecraft, [effect], duration_s=SECONDS)
    record = simulate_setup(inject(spacecraft, [effect], SECONDS), 4, start_ns=10 ** 18)
    np.testing.assert_array_equal(stamps, record.stamps_ns())
    # blocks of another length differ by rounding alone; the record's rms is 0.05 m/s^2
    np.testing.assert_allclose(values, record.values, rtol=0, atol=1e-12)


@pytest.mark.parametrize('name', sorted(set(applicable(None)) - WHOLE))
def test_most_run_without_end(name, spacecraft):
    """Without a length the samples are the same, blocks of 1 s after each other."""
    _, values = joined(spacecraft, [started(name)])
    record = simulate_setup(inject(spacecraft, [started(name)], SECONDS), 4)
    np.testing.assert_allclose(values, record.values, rtol=0, atol=1e-12)     # as above


@pytest.mark.parametrize('name', sorted(WHOLE))
def test_the_others_ask_for_the_length(name, spacecraft):
    """An effect that needs the record's length says so, and names what to set."""
    with pytest.raises(ValueError, match=f'{name} is simulated over the whole record.*duration_s'):
        stream_setup(spacecraft, [parse_effect('sensor_gain:scale=1.1'), started(name)], 4)


def test_no_effect_is_the_nominal_record(spacecraft):
    """Without effects the stream is `simulate`."""
    _, values = joined(spacecraft, (), duration_s=math.inf)
    expected = simulate(assemble(spacecraft), SECONDS, 4).values
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-12)          # as above
