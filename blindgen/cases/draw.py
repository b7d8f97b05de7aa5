# Licensed under the Apache License, Version 2.0.
"""
Draw a spacecraft, its model, and how the truth differs from the model.

The nominal is what the diagnosis is given. Each frequency of the truth is 0.3 to 3 % off, each
damping ratio by up to half, participation and shape by 3 % rms a mode; its mesh differs anyway.
"""
from dataclasses import asdict, dataclass, replace
from typing import ClassVar

from blindgen.effects.base import log_uniform
from blindgen.physics.plate import Plate
from blindgen.physics.propagate import modes_of
from blindgen.physics.scenario import Scenario
from blindgen.physics.spacecraft import Array, clamped_omega, Sensor, Spacecraft
import numpy as np

FREQUENCY = (0.003, 0.03)   # least and largest error of a frequency
DAMPING = 0.5               # largest error of a damping ratio
SHAPE = 0.03                # rms error of participation and of the shape at each sensor
INERTIA, GAIN = 0.02, 0.001
LEVEL_DB, FORCE_DB = 6.0, 3.0               # of each torque and of each modal force, in a record
NOISE = 0.1                 # rms, of the noise level of a record
WARMTH, WARMING = 4e-4, 2e-4                # rms of D with the temperature, of a record, in it
RESOLVED = 6.0              # half-power half bandwidths of the lowest mode in 1 / duration, least
HIGHEST = 0.36              # of the rate: no kept mode lies above


@dataclass(frozen=True)
class Scope:
    """How far the spacecraft and records of a campaign range."""

    rate_hz: tuple = (20.0, 1000.0)
    duration_s: tuple = (60.0, 7200.0)
    scans: tuple = (12_000, 150_000)
    modes: tuple = (3, 10)          # an array
    sensors: tuple = (2, 4)         # an array
    sizes: ClassVar[tuple] = (1.0, 30.0)        # attainable d'
    shares: ClassVar[tuple] = (('none', (0.15, 0.3)), ('pair', (0.06, 0.12)),
                               ('outside', (0.12, 0.25)))       # the rest has one effect


@dataclass(frozen=True)
class LargeEffects(Scope):
    """A scope of effects that are larger, such that most of the gap is more than its floor."""

    sizes: tuple = (20.0, 80.0)     # attainable d'


@dataclass(frozen=True)
class Pairs(Scope):
    """A scope of pairs above all, of effects that are large enough to be seen one by one."""

    sizes: tuple = (8.0, 30.0)      # attainable d'
    shares: tuple = (('none', (0.05, 0.1)), ('pair', (0.7, 0.8)), ('outside', (0.05, 0.1)))


SMALL = Scope((50.0, 400.0), (60.0, 120.0), (6_000, 9_000), (2, 3), (2, 2))
SCOPES = {'full': Scope(), 'small': SMALL, 'large': LargeEffects(**asdict(SMALL)),
          'pairs': Pairs(**asdict(SMALL))}


@dataclass(frozen=True)
class Draft:
    """A nominal spacecraft, the true one, and the length of the record to be diagnosed [s]."""

    nominal: Spacecraft
    truth: Spacecraft
    duration_s: float


def stream(seed, use):
    """Return the random generator of one use of a case's seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(use,)))


def draw_case(seed, scope=Scope()):
    """Return the Draft of a seed; drawn again until the modes are resolved and in the band."""
    rng = stream(seed, 90)
    while True:
        rate = log_uniform(rng, *scope.rate_hz)
        duration = log_uniform(rng, *scope.duration_s)
        if not scope.scans[0] <= rate * duration <= scope.scans[1]:
            continue
        nominal = _spacecraft(rng, float(f'{rate:.3g}'), duration, scope)
        if nominal:
            return Draft(nominal, differ(nominal, rng), float(round(duration)))


def _spacecraft(rng, rate, duration, scope):
    """Return a spacecraft, or None where its modes do not suit rate and duration."""
    damping = log_uniform(rng, 0.003, 0.02)
    lowest, highest = RESOLVED / (damping * duration), 0.05 * rate
    if lowest > 0.9 * highest:
        return None
    base = log_uniform(rng, max(lowest, 0.001 * rate), highest)
    plates, count = [], 1 if rng.random() < 0.1 else 2
    size = np.clip(6.0 * (0.4 / base)**0.4, 0.5, 20.0) * log_uniform(rng, 0.7, 1.4)
    for _ in range(count):
        length = float(size * log_uniform(rng, 0.7, 1.4))
        width, mass = float(length * rng.uniform(0.2, 0.6)), float(rng.uniform(1.5, 4.0))
        first = base * log_uniform(rng, 0.8, 1.25) * 2 * np.pi
        plates.append(Plate(length, width, mass, float((first * length**2 / 3.5)**2 * mass), 0.3))
    if count == 2 and rng.random() < 0.3:
        plates[1] = plates[0]
    arrays = [_array(rng, k, plate, damping, rate, scope) for k, plate in enumerate(plates)]
    if min(a.modes for a in arrays) < scope.modes[0]:
        return None
    inertia = sum(p.mass_per_area_kg_m2 * p.length_m**3 * p.width_m / 3 for p in plates)
    torque = rng.random(3) < (1.0, 0.5, 0.3)
    rigid = inertia * log_uniform(rng, 0.3, 3)
    strength = 0.2 * inertia / size**2           # so that torque and modal forces move alike
    craft = Spacecraft(
        tuple(arrays), tuple(_sensors(rng, arrays, scope)),
        tuple(float(rigid * v) for v in rng.uniform(0.6, 1.4, 3)),
        tuple(float(strength * v * log_uniform(rng, 0.3, 1)) for v in torque),
        0.05 * float(strength / np.sqrt(inertia)) * log_uniform(rng, 0.5, 2),
        1.0, rate, *(log_uniform(rng, 0.1, 2) * rate if rng.random() < 0.6 else np.inf
                     for _ in range(2)))
    craft = replace(craft, noise_rms=float(_loudest(craft) * log_uniform(rng, 0.003, 0.03)))
    return craft if modes_of(Scenario(craft=craft))[0][-1] < 0.42 * rate else None


def _array(rng, k, plate, damping, rate, scope):
    """Return an array with as many modes as lie well below half the rate."""
    probe = Array('', 1.0, plate, scope.modes[1] * (damping,))
    kept = int(np.sum(clamped_omega(probe) < 2 * np.pi * HIGHEST * rate))
    return Array(f'E{k + 1}', 1.0 - 2.0 * k, plate, kept * (float(f'{damping:.3g}'),),
                 float(plate.length_m * rng.uniform(0.08, 0.25)))


def _sensors(rng, arrays, scope):
    """Yield the accelerometers: apart from each other, most far out."""
    for k, array in enumerate(arrays):
        count = int(rng.integers(scope.sensors[0], scope.sensors[1] + 1))
        offsets = rng.random() < 0.4             # asynchronous channels
        for j in range(count):
            along = array.plate.length_m * (0.985 if j < 2 else rng.uniform(0.4, 0.9))
            lateral = array.plate.width_m * rng.uniform(0.25, 0.45) * (1 if j % 2 == 0 else -1)
            yield Sensor(f'e{k + 1}_{"abcdef"[j]}', k, round(float(along), 3),
                         round(float(lateral), 3),
                         offset=float(rng.uniform(0, 0.9)) if offsets else 0.0)


def _loudest(craft):
    """Return the largest rms of the channels, whatever their noise [m/s^2]."""
    from blindgen.physics.spectrum import spectrum
    s, _ = spectrum(Scenario(craft=craft), np.linspace(0, 0.5, 2001)[1:] * craft.rate_hz)
    return float(np.sqrt(np.max(np.einsum('kii->i', s.real)) / len(s)))


def differ(nominal, rng):
    """Return a truth that differs from a nominal spacecraft in all that a model has wrong."""
    arrays, modes = [], nominal.arrays[0].modes
    for array in nominal.arrays:
        modes = array.modes
        off = rng.choice([-1, 1], modes) * np.exp(rng.uniform(*np.log(FREQUENCY), modes))
        damped = np.array(array.damping) * (1 + rng.uniform(-DAMPING, DAMPING, modes))
        arrays.append(replace(
            array, frequency=tuple((1 + off).tolist()), damping=tuple(damped.tolist()),
            participation=tuple((1 + SHAPE * rng.standard_normal(modes)).tolist())))
    sensors = tuple(replace(s, shape=tuple(
        ((1 + GAIN * rng.standard_normal())
         * (1 + SHAPE * rng.standard_normal(arrays[s.array].modes))).tolist()))
        for s in nominal.sensors)
    inertia = nominal.hub_inertia * (1 + INERTIA * rng.standard_normal(3))
    return replace(nominal, arrays=tuple(arrays), sensors=sensors,
                   hub_inertia=tuple(inertia.tolist()))


def state(craft, rng):
    """Return the Scenario of one healthy record of a truth: its own levels, warmth and gaps."""
    db = np.append(rng.uniform(-LEVEL_DB, LEVEL_DB, 3),
                   rng.uniform(-FORCE_DB, FORCE_DB, craft.modes))
    gaps = []
    for _ in range(int(rng.choice([0, 0, 1, 2]))):
        begin, length = rng.uniform(0.05, 0.9), log_uniform(rng, 0.003, 0.08)
        gaps.append((float(begin), float(begin + length)))
    return Scenario(craft, levels=tuple((10**(db / 20)).tolist()),
                    noise_level=float(np.exp(NOISE * rng.standard_normal())),
                    warmth=float(WARMTH * rng.standard_normal()),
                    warming=float(WARMING * rng.standard_normal()), gaps=tuple(gaps))


def healthy(seed, draft):
    """Return [(Scenario, duration_s)] of one to three healthy recordings of a seed."""
    rng = stream(seed, 91)
    return [(state(draft.truth, rng), float(round(draft.duration_s * log_uniform(rng, 0.6, 1.4))))
            for _ in range(int(rng.integers(1, 4)))]


def before(seed, draft):
    """Return the Scenario of the record to be diagnosed, before any effect."""
    return state(draft.truth, stream(seed, 92))
