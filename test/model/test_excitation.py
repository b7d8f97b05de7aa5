"""Excitations: what they are, and that blocks do not matter to any of them."""
import numpy as np
import pytest
from ssi_ros.model import assemble, simulate, Spacecraft
from ssi_ros.model.disturbances import Chirp, Firings, MSequence, Pulses, Sine, ThermalSnap
from ssi_ros.model.excitation import generator, Varying, White

INPUTS = ('a', 'b')
PARTS = [White('w', INPUTS, (1.0, 2.0)), Varying(White('w', INPUTS, (1.0, 2.0)), 0.5, 20.0),
         Sine('b', 1.0, 3.0), Chirp('b', 1.0, 1.0, 9.0, 8.0), Firings('b', 2.0, (1.0, 2.5), 0.1),
         ThermalSnap('b', 1.0, 0.5, 2.0), MSequence('b', 1.0, 7, 0.03), Pulses('b', 0.1, 60.0)]


def force(part, count, step=None, rate_hz=100.0):
    """Return the values of a part, drawn in blocks of `step`."""
    forces = part.begin(rate_hz, INPUTS, generator(1, part.name))
    step = step or count
    return np.vstack([forces(k, min(step, count - k)) for k in range(0, count, step)])


@pytest.mark.parametrize('part', PARTS, ids=lambda p: type(p).__name__)
def test_blocks_do_not_matter(part):
    """Bit for bit the same in one piece and in pieces of 7."""
    assert np.array_equal(force(part, 1000), force(part, 1000, 7))


@pytest.mark.parametrize('part', PARTS, ids=lambda p: type(p).__name__)
def test_covariance_is_that_of_the_values(part):
    """Random parts: 10 % is 4 standard errors of a variance. Determined ones claim none."""
    claimed = part.covariance(100.0, INPUTS)
    if isinstance(part, (White, Varying, Pulses)):
        values = force(part, 200000)
        assert np.diag(np.cov(values.T)) == pytest.approx(np.diag(claimed), rel=0.1)
    else:
        assert not claimed.any()


def test_white_keeps_its_density():
    """The rms at 400 Hz is twice that at 100 Hz; 2 % is 4 standard errors."""
    part = White('w', INPUTS, (1.0, 2.0))
    assert force(part, 40000, rate_hz=400.0).std(axis=0) == pytest.approx([2.0, 4.0], rel=0.02)


def test_level_varies():
    """Depth 0.5: the strongest quarter over the weakest is 1.45 / 0.55, to 10 %."""
    values = force(Varying(White('w', INPUTS, (1.0, 2.0)), 0.5, 20.0), 200000)[:, 0]
    quarter = (np.arange(200000) % 2000) // 500
    high = values[(quarter == 0) | (quarter == 1)].std()
    low = values[(quarter == 2) | (quarter == 3)].std()
    # half periods: mean squares of 1 +- 0.5 |sin| are 1.7616 and 0.4884
    assert high / low == pytest.approx(np.sqrt(1.7616 / 0.4884), rel=0.02)


def test_m_sequence_is_white_over_its_period():
    """The circular autocorrelation of an m-sequence is -1 / period at every other lag."""
    values = force(MSequence('b', 1.0, 7, 0.01), 127)[:, 1]
    correlation = [np.mean(values * np.roll(values, k)) for k in range(1, 127)]
    assert correlation == pytest.approx([-1 / 127] * 126)


def test_firing_and_pulse_have_their_impulse():
    """A firing of 2 N m for 0.1 s gives 0.2 N m s, a pulse its impulse whatever the rate."""
    assert force(Firings('b', 2.0, (1.0,), 0.1), 300)[:, 1].sum() / 100 == pytest.approx(0.2)
    for rate_hz in (100.0, 250.0):
        values = force(Pulses('b', 0.1, 60.0), 5000, rate_hz=rate_hz)[:, 1]
        impulses = values[values > 0] / rate_hz
        assert np.min(impulses) == pytest.approx(0.1)


def test_sine_starts_in_its_steady_state():
    """The first 10 s repeat after whole periods to 1e-9; from rest they do not."""
    system = assemble(Spacecraft())
    parts = (Sine('torque_x', 1.0, 5.0),)
    from dataclasses import replace
    quiet = replace(system, chain=())
    values = simulate(quiet, 20.0, 1, excitation=parts).values
    assert values[1000:] == pytest.approx(values[:1000], abs=1e-9 * np.abs(values).max())
    rest = simulate(quiet, 20.0, 1, excitation=parts, at_rest=True).values
    assert np.abs(rest[1000:] - rest[:1000]).max() > 0.01 * np.abs(rest).max()
    # and its amplitude is the discrete transfer function's
    gain = np.abs(quiet.transfer([5.0], 100.0)[0, :, 0])
    assert values.std(axis=0) * np.sqrt(2) == pytest.approx(gain, rel=1e-9)


def test_bad_parts_are_refused():
    """The message names the value."""
    with pytest.raises(ValueError, match='depth=2'):
        Varying(White('w', INPUTS, (1.0, 1.0)), 2.0, 1.0)
    with pytest.raises(ValueError, match='rms='):
        White('w', INPUTS, (1.0,))
