"""The small changes that several effects make."""
from dataclasses import replace

import numpy as np

from ssi_ros.model.excitation import source
from ssi_ros.model.machines import is_machine
from ssi_ros.model.sensors import Mix
from ssi_ros.quantity import unknown

LINES = 50              # frequencies of a band that responses are taken at


def channel_index(system, channel):
    """Return the index of a channel, ValueError with the near names if there is none."""
    if channel not in system.channels:
        raise ValueError(unknown(f'channel {channel!r}', channel, system.channels))
    return system.channels.index(channel)


def change_array(spacecraft, name, **changes):
    """Return the spacecraft with numbers of one array changed."""
    spacecraft.array(name)
    return replace(spacecraft, arrays=tuple(
        replace(a, **changes) if a.name == name else a for a in spacecraft.arrays))


def scale_stiffness(system, arrays, scale):
    """
    Return the system with the bending stiffness D of arrays times `scale`, eq. (81).

    Without arrays (none are named) it is the whole stiffness matrix.

    Shapes do not depend on D, so Omega^2 follows D and, at the same damping ratio, Omega its
    root. A hinge keeps its stiffness.
    """
    prefixes = tuple(f'{a}_eta' for a in arrays)
    rows = np.array([not prefixes or d.startswith(prefixes) for d in system.dofs])
    both = np.outer(rows, rows)
    return replace(system, stiffness=np.where(both, scale * system.stiffness, system.stiffness),
                   damping=np.where(both, np.sqrt(scale) * system.damping, system.damping))


def mix(setup, matrix):
    """Return the setup with the channels mixed before any other stage of the chain."""
    stage = Mix(tuple(map(tuple, matrix.tolist())))
    return replace(setup, system=replace(setup.system, chain=(stage,) + setup.system.chain))


def add_stage(setup, stage):
    """Return the setup with a stage at the end of the sensor chain."""
    return replace(setup, system=replace(setup.system, chain=setup.system.chain + (stage,)))


def input_name(system, name):
    """Return the name of an input, of the first one for 'first'; ValueError if it is not there."""
    if name == 'first':
        return system.inputs[0]
    if name not in system.inputs:
        raise ValueError(unknown(f'input {name!r}', name, system.inputs))
    return name


def add_part(setup, part):
    """Return the setup with one more part of the excitation."""
    return replace(setup, system=replace(setup.system,
                                         excitation=setup.system.excitation + (part,)))


def with_held_inputs(setup):
    """
    Return the setup whose machines act through inputs that are held over each sample, (83a).

    Of one that cannot be propagated without: a sine or a sweep then has the rms ratio of steady
    and held responses over its band, at all channels together.
    """
    system = setup.system
    parts = tuple(_held(p, system) if is_machine(p) else p for p in system.excitation)
    return replace(setup, system=replace(system, excitation=parts))


def _held(part, system):
    if part is not source(part):
        return replace(part, part=_held(part.part, system))
    low, high = part.band_hz
    at = np.linspace(low, high, LINES if high > low else 1)
    where = [system.inputs.index(part.input)]
    steady, held = (np.sum(np.abs(system.transfer(at, rate_hz, where)) ** 2) for rate_hz in (
        None, system.rate_hz))
    # an input that no channel shows has no response of either kind
    ratio = float(np.sqrt(steady / held)) if held else 1.0
    return replace(part, amplitude=part.amplitude * ratio, held=True)
