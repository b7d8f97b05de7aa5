"""
Diagnose records with changes drawn from families that no template of the library can hold.

    python -m validation.gap_unknown calibrate [RECORDS] [SECONDS]
    python -m validation.gap_unknown flagged [RECORDS] [SECONDS]
    python -m validation.gap_unknown diagnose [RECORDS] [SECONDS]

`calibrate` prints what records without effect give for every family of the open-set test,
`flagged` what records with unknown changes give, without a diagnosis, and `diagnose` what a
diagnosis says of them. Every change is scaled so that an oracle that knows it has a deflection d'
between 8 and 30: of a known disturbance d of the channels sqrt(sum d^H S^-1 d), of random forces
sqrt(sum tr (S^-1 dS)^2), over the bins of the whole record.
"""
import argparse
from collections import defaultdict
from dataclasses import replace
import time

import numpy as np
from scipy.signal import butter, sosfilt
from ssi_ros.effects import inject, library, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors import open_set
from ssi_ros.gap.detectors.input_reconstruction import reconstruct
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.whittle import Evidence
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame, spectra, whole_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.model.excitation import begin_all, generator
from ssi_ros.model.simulator import propagate, stationary_start
from ssi_ros.open_set.families import joined
from ssi_ros.records import Samples

from validation.gap_reference import at_decibel

DETECTIONS = 8.0, 30.0  # d' that is drawn, even in the logarithm
ROUNDS = 3              # of a force that depends on the motion
LEVEL = 0.05            # p-value of all tests below which a record is flagged
QUANTILES = 0.01, 0.2   # of the p-values, that are made right


class World:
    """A spacecraft with a force along a random direction of one array that any law may make."""

    def __init__(self, craft, seconds, seed):
        self.rng, self.seed = np.random.default_rng([77, seed]), seed
        self.system = inject(at_decibel(craft, self.rng.uniform(-3, 3)), (), seconds).system
        self.rate_hz, self.rows = self.system.rate_hz, round(seconds * self.system.rate_hz)
        self.t = np.arange(self.rows) / self.rate_hz

    def direction(self, sparse=True):
        """Return a random direction of the freedoms of one array, (n,)."""
        dofs = self.system.dofs
        array = self.rng.choice(['E1', 'E2'])
        rows = [i for i, d in enumerate(dofs) if d.startswith(f'{array}_eta')]
        w = np.zeros(len(dofs))
        if sparse:
            w[self.rng.choice(rows)] = 1.0
        else:
            w[rows] = self.rng.standard_normal(len(rows))
        return w / np.linalg.norm(w)

    def run(self, w=None, law=None, scale=None, stiffness=None, mass=None):
        """Return channels without noise, and displacement and speed along w, of some changes."""
        system, n = self.system, len(self.system.dofs)
        w = np.zeros(n) if w is None else w
        changes = {k: getattr(system, k) + v for k, v in (
            ('stiffness', stiffness), ('mass', mass)) if v is not None}
        system = replace(system, chain=(), input=np.column_stack([system.input, w]),
                         inputs=(*system.inputs, 'law'), **changes)
        sampled = system.plant.discrete(self.rate_hz)
        forces = begin_all(system.excitation, self.rate_hz, system.inputs, self.seed)(
            0, self.rows).copy()
        if scale is not None:
            forces *= scale[:, None]
        begin = stationary_start(sampled, system.excitation, system.inputs, self.seed)
        names = list(system.plant.states)
        rows = np.zeros((2, len(names)))
        for i in np.flatnonzero(w):
            rows[0, names.index(system.dofs[i])] = w[i]
            rows[1, names.index(system.dofs[i] + '_rate')] = w[i]
        local = replace(sampled, c=rows @ sampled.vectors, d=np.zeros((2, len(system.inputs))))
        q, v = propagate(local, forces, begin)[0].T
        for _ in range(ROUNDS if law is not None else 0):
            forces[:, -1] = law(q, v)
            q, v = propagate(local, forces, begin)[0].T
        return propagate(sampled, forces, begin)[0], q, v

    def noise(self):
        """Return the noise of the channels."""
        stage = next(s for s in self.system.chain if s.name == 'sensor_noise')
        return stage.begin(self.rate_hz, generator(self.seed, stage.name))(
            np.zeros((self.rows, len(self.system.channels))))


def wave(rng, t, slow=False):
    """Return a random function of time of unit rms: waves, a jump, or noise below 0.3 Hz."""
    kind = rng.integers(2 if slow else 3)
    if kind == 0:
        return np.sign(t - rng.uniform(0.2, 0.8) * t[-1])
    if kind == 1:
        noise = sosfilt(butter(2, 10 ** rng.uniform(-2.3, -0.5), output='sos', fs=1 / t[1]),
                        rng.standard_normal(len(t)))
        return noise / noise.std()
    return np.sqrt(2) * np.sin(2 * np.pi * 10 ** rng.uniform(-2.3, -0.3) * t
                               + rng.uniform(0, 2 * np.pi))


def static_curve(world):
    """Return a random smooth curve of one channel, less its straight line."""
    rng, (clean, *_) = world.rng, world.run()
    y = clean + world.noise()
    at = rng.integers(y.shape[1])
    u = y[:, at] / y[:, at].std()
    curve = sum(rng.standard_normal() * np.sin(rng.uniform(0.5, 3) * u + rng.uniform(0, 6))
                for _ in range(3))
    lines = np.column_stack([np.ones_like(u), u])
    delta = np.zeros_like(y)
    delta[:, at] = curve - lines @ np.linalg.lstsq(lines, curve, rcond=None)[0]
    return lambda size: y + size * y[:, at].std() * delta


def modulated_matrix(world):
    """Return a stiffness or a damping along a random direction that varies with time."""
    w, shape = world.direction(), wave(world.rng, world.t)
    i = int(np.argmax(w))
    stiff = world.rng.random() < 0.6
    k = (world.system.stiffness if stiff else world.system.damping)[i, i]
    return lambda size: world.run(w, lambda q, v: -size * k * shape * (q if stiff else v))[0]


def modulated_input(world):
    """Return a channel whose gain, or an input whose level, varies with time."""
    shape, channel = wave(world.rng, world.t), world.rng.integers(4)
    if world.rng.random() < 0.5:
        return lambda size: world.run(scale=1 + size * shape)[0]
    gains = np.zeros((world.rows, 4))
    gains[:, channel] = shape
    return lambda size: world.run()[0] * (1 + size * gains)


def joint_law(world):
    """Return a force that is no linear function of the motion along a random direction."""
    w, kind = world.direction(), world.rng.integers(4)
    i = int(np.argmax(w))
    k, c = world.system.stiffness[i, i], world.system.damping[i, i]
    _, q0, v0 = world.run(w)
    a, b = q0.std(), v0.std()
    laws = (lambda q, v: -k * a * np.tanh(q / a), lambda q, v: -c * np.abs(v) * v / b,
            lambda q, v: -k * np.maximum(q - a, 0.0), lambda q, v: -k * q ** 3 / a ** 2)
    return lambda size: world.run(w, lambda q, v: size * laws[kind](q, v))[0]


def random_filter(world):
    """Return a channel behind a random smooth filter."""
    rng, (y, *_) = world.rng, world.run()
    f = np.fft.rfftfreq(world.rows, 1 / world.rate_hz)
    at, x = rng.integers(4), np.log(np.maximum(f, 0.05))
    shape = sum((rng.standard_normal() + 1j * rng.standard_normal())
                * np.exp(-(x - rng.uniform(np.log(0.3), np.log(40))) ** 2
                         / 2 / rng.uniform(0.1, 0.8) ** 2) for _ in range(3))

    def make(size):
        out = y.copy()
        out[:, at] = np.fft.irfft(np.fft.rfft(y[:, at]) * (1 + size * shape), world.rows)
        return out
    return make


def extra_oscillator(world):
    """Return a small mass on a spring at a random direction: its reaction on the structure."""
    w, rng = world.direction(sparse=False), world.rng
    omega, zeta = 2 * np.pi * 10 ** rng.uniform(-0.1, 1.4), 10 ** rng.uniform(-2.5, -1)
    n, dt = world.rows, 1 / world.rate_hz
    s = 2j * np.pi * np.fft.rfftfreq(2 * n, dt)

    def reaction(size):
        def law(q, v):
            # mass times the acceleration of the oscillator on its moving base
            spectrum = np.fft.rfft(q - q[0], 2 * n)
            x = spectrum * (omega ** 2 + 2 * zeta * omega * s) / (
                s ** 2 + 2 * zeta * omega * s + omega ** 2)
            return -size * np.fft.irfft(s ** 2 * x, 2 * n)[:n]
        return law
    return lambda size: world.run(w, reaction(size))[0]


def extra_input(world):
    """Return a random force of random colour along a random direction."""
    rng, w = world.rng, world.direction(sparse=False)
    low = 10 ** rng.uniform(-0.9, 1.0)
    force = sosfilt(butter(2, [low, min(low * rng.uniform(2, 10), 45.0)], 'bandpass',
                           output='sos', fs=world.rate_hz), rng.standard_normal(world.rows))
    force /= force.std()
    return lambda size: world.run(w, lambda q, v: size * force)[0]


def point_process(world):
    """Return pulses of random heights at random times along a random direction."""
    rng, w = world.rng, world.direction(sparse=False)
    force = (rng.random(world.rows) < 10 ** rng.uniform(-3.6, -2.5)) * (
        1 + rng.exponential(1, world.rows)) * rng.choice([-1, 1], world.rows)
    shape = np.ones(int(rng.integers(1, 30)))
    force = np.convolve(force, shape)[:world.rows]
    return lambda size: world.run(w, lambda q, v: size * force)[0]


def corruption(world):
    """Return random samples of one channel that are displaced, or of a neighbour in time."""
    rng, (clean, *_) = world.rng, world.run()
    y, at = clean + world.noise(), rng.integers(4)
    rows = rng.random(world.rows) < 10 ** rng.uniform(-3.5, -1.5)
    other = np.roll(y[:, at], int(rng.integers(2, 20))) if rng.random() < 0.5 else (
        y[:, at] + y[:, at].std() * rng.standard_normal(world.rows))

    def make(size):
        out = y.copy()
        out[rows, at] += size * (other - y[:, at])[rows]
        return out
    return make


FAMILIES = {f.__name__: f for f in (
    static_curve, modulated_matrix, modulated_input, joint_law, random_filter, extra_oscillator,
    extra_input, point_process, corruption)}
NOISY = static_curve, corruption        # that act on what is recorded, noise and all
RANDOM = extra_input, point_process


def deflection(world, delta, random):
    """Return d' of a disturbance (n, l) of the channels of a record."""
    settings, seconds = DiagnosisSettings(), world.rows / world.rate_hz
    frame = make_frame(world.rows, world.rate_hz, settings)
    side = Simulator(load_spacecraft(), frame, seconds)
    whole = whole_frame(world.rows, world.rate_hz, settings, 1.0)
    inverse = np.linalg.inv(side.on(whole).expected(Candidate()).at_nominal[0])
    d = spectra(Samples(delta, world.rate_hz, world.system.channels), whole)[0]
    power = np.einsum('ki,kij,kj->k', d.conj(), inverse, d).real
    if not random:
        return float(np.sqrt(2 * power.sum()))
    smooth = np.convolve(power, np.ones(9) / 9, mode='same')
    return float(np.sqrt((smooth ** 2).sum()))


def draw(name, craft, seconds, seed):
    """Return Samples with a change of a family, and its d'."""
    family = FAMILIES[name]
    world = World(craft, seconds, seed + 1000 * list(FAMILIES).index(name))
    make, noise = family(world), 0.0 if family in NOISY else world.noise()
    low, high = np.log(DETECTIONS)
    wanted, size, random = np.exp(world.rng.uniform(low, high)), 1e-3, family in RANDOM
    base = make(0.0)
    for _ in range(5):
        found = deflection(world, make(size) - base, random)
        if abs(found / wanted - 1) < 0.05:
            break
        size *= (wanted / found) ** (0.5 if random else 1.0)
    return Samples(make(size) + noise, world.rate_hz, world.system.channels), found


def tested(simulator, fitted, samples):
    """Return the Findings of the open-set test of a record beside a fitted model."""
    inputs = reconstruct(simulator, fitted, samples, DiagnosisSettings())
    return [(d.basis, d.p_value) for d in open_set(simulator, fitted, inputs, samples.channels)]


def calibrate(records, seconds):
    """Print shares of small p-values of every family, and the factor and power that go with it."""
    craft, found = load_spacecraft(), defaultdict(list)
    frame = make_frame(round(seconds * craft.rate_hz), craft.rate_hz, DiagnosisSettings())
    simulator = Simulator(craft, frame, seconds)
    for seed in range(records):
        level = np.random.default_rng(seed).uniform(-3, 3)
        samples = simulate_setup(inject(at_decibel(craft, level), (), seconds), 20_000 + seed)
        fitted = fit(simulator, Evidence(frame, spectra(samples, frame), frame.used))
        own = tested(simulator, fitted, samples)
        for family, p_value in own:
            found[family].append(p_value)
        found['together'].append(joined([p for _, p in own]))
    print('| family | p < 0.2 | p < 0.05 | p < 0.01 | least | factor, power to add |')
    print('|' + '---|' * 6)
    for family, p in found.items():
        low, high = np.quantile(p, QUANTILES)
        power = np.log(QUANTILES[1] / QUANTILES[0]) / np.log(high / low)
        print(f'| {family} | ' + ' | '.join(f'{np.mean(np.array(p) < a):.3f}'
                                            for a in (0.2, 0.05, 0.01))
              + f' | {min(p):.1g} | {QUANTILES[1] / high ** power:.2f}, {power:.2f} |')


def flagged(records, seconds):
    """Print how many records of every family have a small p-value, and by what."""
    craft = load_spacecraft()
    print("| family | d' 8 to 15 | d' 15 to 30 | what was found |\n|---|---|---|---|")
    for name in FAMILIES:
        hits, words = {False: [], True: []}, defaultdict(int)
        for seed in range(records):
            samples, size = draw(name, craft, seconds, seed)
            comparison = ModelNominal(craft).compare(samples, DiagnosisSettings(),
                                                     tuple(library()), lambda share: None)
            own = tested(comparison.simulator, comparison.null.state, samples)
            p = comparison.residual(comparison.null).p_value
            hits[size > 15].append(p < LEVEL)
            words[comparison.mismatch or min(own, key=lambda f: f[1])[0]
                  if joined([p for _, p in own]) < 0.01 else
                  'another test' if p < LEVEL else 'nothing'] += 1
        print(f'| {name} | ' + ' | '.join(f'{sum(hits[k])} of {len(hits[k])}' for k in hits)
              + f' | {", ".join(f"{k}: {v}" for k, v in words.items())} |', flush=True)


def diagnosed(records, seconds):
    """Print what a diagnosis says of every family."""
    craft = load_spacecraft()
    print("| family | d' | outcome | p | P(none) | named | signs | CPU s |\n" + '|---' * 8 + '|')
    for name in FAMILIES:
        for seed in range(records):
            samples, size = draw(name, craft, seconds, seed)
            begin = time.process_time()
            found = diagnose(craft, samples)
            unknown = sum(c.probability for c in found.candidates if c.effects == ('unknown',))
            print(f'| {name} | {size:.1f} | {found.outcome} | {found.gap["p_value"]:.1e} | '
                  f'{unknown:.2f} | {" + ".join(found.verdict["effects"])} | '
                  f'{"; ".join(found.signs)} | {time.process_time() - begin:.0f} |', flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    commands = {'calibrate': calibrate, 'flagged': flagged, 'diagnose': diagnosed}
    parser.add_argument('command', choices=commands)
    parser.add_argument('records', nargs='?', type=int, default=10)
    parser.add_argument('seconds', nargs='?', type=float, default=600.0)
    given = parser.parse_args()
    commands[given.command](given.records, given.seconds)
