"""Torques that are not held over a sample: sample by sample what much finer steps give."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.model import assemble, load_spacecraft, simulate
from ssi_ros.model.disturbances import Chirp, Sine
from ssi_ros.model.excitation import Varying
from ssi_ros.model.simulator import stream

RATE_HZ, FINER, SECONDS = 100.0, 100, 20.0
SINE = Sine('torque_x', 1.0, 33.0, 0.3, held=False)
CHIRP = Chirp('torque_x', 1.0, 2.0, 38.0, SECONDS, held=False)


@pytest.fixture(scope='module')
def quiet():
    craft = load_spacecraft()
    return replace(assemble(craft), excitation=(), chain=())


def channels(system, part, rate_hz=RATE_HZ, **options):
    return simulate(system, SECONDS, 1, excitation=(part,), rate_hz=rate_hz, **options).values


def held(part):
    """Return the same, held over each sample."""
    return (replace(part, part=held(part.part)) if isinstance(part, Varying) else
            replace(part, held=True))


@pytest.mark.parametrize('part, at_rest', [
    (SINE, False), (SINE, True), (CHIRP, False), (CHIRP, True), (Varying(SINE, 0.5, 7.0), True)])
def test_channels_are_those_of_fine_steps(quiet, part, at_rest):
    """Steps of a hundredth of a sample leave 1 % at 33 Hz, steps of a sample 15 % and more."""
    fine = channels(quiet, held(part), FINER * RATE_HZ, at_rest=at_rest)[::FINER]
    error = [np.std(channels(quiet, p, at_rest=at_rest) - fine, axis=0) / fine.std(axis=0)
             for p in (part, held(part))]
    assert np.all(error[0] < 0.02) and np.all(error[1] > 0.15)


def test_blocks_go_on(quiet):
    """A record in blocks is the record."""
    whole = channels(quiet, CHIRP)
    blocks = stream(quiet, 1, 3.0, excitation=(CHIRP,))
    some = np.concatenate([next(blocks).values for _ in range(4)])
    np.testing.assert_allclose(some, whole[:len(some)], rtol=0, atol=1e-9 * whole.std())
