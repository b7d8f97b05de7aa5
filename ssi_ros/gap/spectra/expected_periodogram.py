"""The expected periodogram of a setup, exact with taper and aliases, eq. (94) and (95)."""
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain

import numpy as np

from ssi_ros.effects.drifting import drifting
from ssi_ros.effects.edits import with_held_inputs
from ssi_ros.effects.sampling_instants import SamplingInstants
from ssi_ros.effects.statistical_linearisation import LinearisationResidual, linearise
from ssi_ros.model.disturbances import Chirp, Nutation, Sine
from ssi_ros.model.excitation import Filtered, layers, source, White
from ssi_ros.model.sensors import Noise
from ssi_ros.model.statespace import powers_of, stationary_divisor
from ssi_ros.weighted_sums import changed, each_of, interpolated, total_of, WeightedSum

ROUNDING = 1e-6         # by which the poles of a rigid body may leave the unit circle
LONG = 100_000          # rows, of more of which no spectrum is kept: it is asked for once
BLOCK = 16_384          # lags that are computed at once


@dataclass(frozen=True, eq=False)
class Expected:
    """Expected periodograms, linear in the levels: S = fixed + sum_c level_c shares_c."""

    names: tuple        # of the levels: each random part of the excitation, sensor noise
    held: tuple         # shares, each a WeightedSum or an array, (1, k, l, l)
    fixed: np.ndarray   # (a, k, l, l), what no level scales: lines, low-frequency noise
    near: tuple = None  # linear equivalents of nonlinear hinges, `Setup.near`

    @property
    def shares(self):
        """Return the share of each level, (a, k, l, l); a is 1, or all parts where they differ."""
        return tuple(each_of(s) for s in self.held)

    def at(self, levels):
        """Return S at the levels, shape (a, k, l, l)."""
        return each_of(total_of(chain([self.fixed], (
            changed(share, partial(np.multiply, level))
            for level, share in zip(levels, self.held)))))

    @property
    def at_nominal(self):
        """Return S at nominal levels, shape (a, k, l, l)."""
        return each_of(self.few_at_nominal)

    @property
    def few_at_nominal(self):
        """Return S at nominal levels, a WeightedSum or (a, k, l, l)."""
        return total_of([self.fixed, *self.held])


def power_of(shares):
    """Return the power of parts of an expected spectrum."""
    return float(sum(np.trace(s.mean(axis=(0, 1))).real for s in shares))


def expected(setup, frame, jitter_noise=None, one=None):
    """
    Compute the Expected of a setup, of `inject`, whose record is cut as a frame says.

    The autocovariance of the sampled system is a sum of its poles, eq. (94); times the overlap
    of the taper with itself, its Fourier transform is the mean of the periodogram, leakage and
    aliases included. Nonlinear hinges enter by their equivalent linear ones. JitterNoise is of the
    motion of a record; without it, that of the mean motion, eq. (95b), counts. `one` computes it
    in place of `steady`. Source: Sykulski et al., Biometrika 106(2), 2019 (debiased Whittle).
    """
    one = one or steady
    # as `simulate_setup` does
    setup = with_held_inputs(setup) if setup.laws or setup.drift else setup
    if not setup.drift:
        return one(setup, frame, jitter_noise)
    at, weights = drifting(setup, frame.mean_of_parts(frame.begins_s) + frame.span_s / 2)
    each = [one(there, frame, jitter_noise) for there in at]
    return Expected(each[0].names, tuple(interpolated(weights, s) for s in zip(
        *(e.held for e in each))), each_of(interpolated(weights, [e.fixed for e in each]))
        if any(np.any(e.fixed) for e in each) else each[0].fixed)


def steady(setup, frame, jitter_noise):
    """Compute the Expected of a setup without drift."""
    setup = linearise(setup)
    system, rate_hz = setup.system, setup.system.rate_hz
    sampled = system.state_space.discrete(rate_hz)
    if np.abs(sampled.poles).max(initial=0.0) > 1 + ROUNDING:
        raise ValueError('the system is not stable; it has no expected spectrum')
    free, sampled = sampled, sampled.within(frame.settles)
    for row, column in setup.lags:
        sampled = sampled.with_lag(row, column)
    count = len(system.channels)
    names, shares = [], []
    fixed = np.zeros((1, frame.last - frame.first, count, count), complex)
    sampling = SamplingInstants(setup, frame, jitter_noise)
    for part in system.excitation:
        inner, colour, level = source(part), 1.0, None
        for layer in layers(part):
            if isinstance(layer, Filtered):
                colour = colour * layer.power(frame.frequencies_hz)[:, None, None]
            else:
                level = layer
        if isinstance(inner, Nutation):
            share = _free(free, inner.state(free, system.inputs), frame)
        elif isinstance(inner, (Sine, Chirp)):
            share = _line(inner, sampled, system, frame)
        else:
            inputs = inner.covariance(rate_hz, system.inputs)
            share = _random(level, sampled, inputs, frame)
            if np.ndim(colour):
                share = changed(share, partial(np.multiply, colour))
        # the jitter noise of a record is of all its parts
        share = changed(each_of(share) if jitter_noise else share, partial(sampling, part=inner))
        if isinstance(inner, White) and inner.free:
            names.append(inner.name)
            shares.append(share)
        elif isinstance(inner, LinearisationResidual):
            shares[names.index(inner.name)] = total_of([shares[names.index(inner.name)], share])
        else:
            fixed = fixed + share
    if np.any(sampling.noise):
        fixed = fixed + sampling.at_once(sampling.noise)
    white = np.zeros((1, 1, count, count))
    for stage in system.chain:
        gain = stage.response(np.zeros(1), count)[0]
        shares = [changed(s, partial(_through, gain)) for s in shares]
        white, fixed = _through(gain, white), _through(gain, fixed)
        if isinstance(stage, Noise):
            white = white + stage.noise_covariance(count)
        elif hasattr(stage, 'autocovariance'):
            fixed = fixed + transform(
                stage.autocovariance(count, frame.rows, rate_hz), frame.overlap, frame)
    shares.append(np.broadcast_to(white * frame.overlap[0] + 0j, fixed[:1].shape))
    shares, fixed = [changed(s, sampling.late) for s in shares], sampling.late(fixed)
    return Expected(tuple(names) + (Noise.name,), tuple(shares), fixed, setup.near)


def _through(gain, spectrum):
    """Return G S G^T; most stages are diagonal, or do nothing."""
    own = np.diag(gain)
    if np.any(gain != np.diag(own)):
        return gain @ spectrum @ gain.T
    return spectrum if np.all(own == 1.0) else np.outer(own, own) * spectrum


def autocovariance(sampled, inputs, powers, turn=1.0, lags=None):
    """Return E[y(k + lag) y(k)^T] for lag = 0, 1, ..., shape (lags, l, l), eq. (94)."""
    # With `turn` not 1 the part of it, complex, that goes with turn^k where the inputs do, (95a);
    # else of more lags than `powers` has, if asked for.
    live = np.flatnonzero(inputs.any(axis=0))
    pair = sampled.weight > 1
    q = inputs[np.ix_(live, live)]
    poles = np.concatenate([sampled.poles, sampled.poles[pair].conj()])
    b = np.vstack([sampled.b, sampled.b[pair].conj()])[:, live]
    c = np.hstack([sampled.c, sampled.c[:, pair].conj()])
    d = sampled.d[:, live]
    state = (b @ q @ b.conj().T) / stationary_divisor(poles, sampled.rate_hz, turn)
    ahead = poles[:, None] * (state @ c.conj().T) + b @ q @ d.T        # E[z(k + 1) y(k)^T]
    kept, count = len(sampled.poles), len(c)
    now = c @ state @ c.conj().T + d @ q @ d.T
    # R(lag) = sum c_i pole_i^(lag - 1) ahead_i: one product for all lags
    residues = (c.T[:, :, None] * ahead[:, None, :]).reshape(-1, count * count)
    if turn == 1.0:
        # poles in pairs: twice the real part of one of them
        residues = sampled.weight[:, None] * residues[:kept]
        # one series of lags after the other, as they are transformed
        out = np.empty((count * count, lags or len(powers) + 1))
        out[:, 0] = now.real.ravel()
        for first in range(1, out.shape[1], len(powers)):
            there = residues * (poles[:kept] ** (first - 1))[:, None]
            parts = np.stack([there.real, -there.imag], axis=1).reshape(2 * kept, -1)
            block = out[:, first:first + len(powers)]
            np.matmul(parts.T, powers[:block.shape[1]].view(float).T, out=block)
        return out.reshape(count, count, -1).transpose(2, 0, 1)
    later = powers @ residues[:kept] + powers[:, pair].conj() @ residues[kept:]
    return np.concatenate([now[None], later.reshape(-1, count, count)])


class _Response:
    """The random motion of sampled outputs; equal numbers in the same frame are equal."""

    def __init__(self, sampled, inputs, frame):
        self.parts = sampled, inputs, frame
        self.key = id(frame), *(np.asarray(x).tobytes() for x in (
            inputs, sampled.poles, sampled.b, sampled.c, sampled.d))

    def __eq__(self, other):
        return self.key == other.key

    def __hash__(self):
        return hash(self.key)


@lru_cache(maxsize=6)
def _kept(response):
    # faults of sensors and of clocks leave the motion of the structure as it is
    sampled, inputs, frame = response.parts
    powers = powers_of(sampled.poles, min(frame.rows - 1, BLOCK))
    found = transform(autocovariance(sampled, inputs, powers, lags=frame.rows),
                      frame.overlap, frame)
    found.flags.writeable = False
    return found


def _random(level, sampled, inputs, frame):
    """
    Return the expected periodograms under random inputs, (1, k, l, l), or a WeightedSum.

    The square of a modulated level has three parts, of 0, 1 and 2 times its frequency; a slow
    mode follows each with a lag of its own, eq. (95a).
    """
    made = _kept if frame.rows <= LONG else _kept.__wrapped__
    steady = made(_Response(sampled, inputs, frame))[None]
    if level is None:
        return steady
    powers = powers_of(sampled.poles, frame.rows - 1)
    omega = 2 * np.pi / level.period_s
    once = level.depth * np.exp(1j * (level.phase_rad - np.pi / 2))
    tapered = np.fft.fft(frame.taper, 2 * frame.rows)
    whole = np.fft.ifft(np.abs(tapered) ** 2).real[:frame.rows]
    thinned = frame.overlap / np.maximum(whole, 1e-12 * whole[0])     # by missing rows
    few, weights = [(1 + level.depth ** 2 / 2) * steady[0]], [np.ones(frame.parts)]
    for times, part in ((1, once), (2, once ** 2 / 4)):
        turn = np.exp(1j * times * omega / frame.rate_hz)
        turned = np.fft.fft((frame.taper * turn ** np.arange(frame.rows)).conj(), 2 * frame.rows)
        overlap = np.fft.ifft(turned.conj() * tapered)[:frame.rows] * thinned
        values = 2 * part * overlap[:, None, None] * autocovariance(sampled, inputs, powers, turn)
        phase = frame.mean_of_parts(np.exp(1j * times * omega * frame.begins_s))
        few += [transform(values.real, 1.0, frame), transform(values.imag, 1.0, frame)]
        weights += [phase.real, -phase.imag]
    return WeightedSum(np.stack(few), np.stack(weights, axis=1))


def transform(autocovariance, overlap, frame):
    """Return the expected periodogram of an autocovariance (n, l, l), (k, l, l), eq. (95)."""
    count = autocovariance.shape[1]
    overlap = np.broadcast_to(overlap, len(autocovariance))
    found = np.empty((frame.last - frame.first, count, count), complex)
    for row in range(count):        # one pair after the other stays in the cache
        for column in range(row, count):
            both = autocovariance[:, row, column] * overlap
            # what two channels share at negative lags, folded to the end of the segment
            both[1:] += (autocovariance[:, column, row] * overlap)[:0:-1]
            half = np.fft.rfft(both)[frame.first:frame.last]
            found[:, column, row], found[:, row, column] = half.conj(), half
        found[:, row, row] = found[:, row, row].real
    return found


def _line(part, sampled, system, frame):
    """Return the periodogram of a sine or a chirp of unknown phase, ([parts,] k, l, l)."""
    where, sine, n = system.inputs.index(part.input), isinstance(part, Sine), np.arange(frame.rows)
    turns = 2j * np.pi * (np.array([part.frequency_hz / sampled.rate_hz]) if sine else
                          np.arange(frame.first, frame.last) / frame.rows)
    response = (sampled.response(np.exp(turns), [where]) if part.held else
                system.state_space.response(turns * sampled.rate_hz, [where]))[:, :, 0]
    if sine:
        response = response[0] * part.amplitude / 2
        window = np.abs(np.fft.fft(frame.taper * np.exp(turns * n))) ** 2
        return (window[frame.first:frame.last, None, None]
                * np.outer(response, response.conj())[None])
    drive = part.at(np.reshape(frame.begins, (-1, 1)) + n, sampled.rate_hz)
    drive = np.fft.fft(drive * frame.taper, axis=1)
    power = frame.mean_of_parts(np.abs(drive[:, frame.first:frame.last]) ** 2)
    return power[:, :, None, None] * (response[:, :, None] * response[:, None, :].conj())[None]


def _free(sampled, state, frame):
    """Return the periodogram of free motions that go on from a modal state, (1, k, l, l)."""
    total = np.zeros((1, 1, 1, 1))
    for i in np.flatnonzero(state):
        turned = frame.taper * np.exp(1j * np.angle(sampled.poles[i]) * np.arange(frame.rows))
        window = np.abs(np.fft.fft(turned)[frame.first:frame.last]) ** 2
        shape = sampled.c[:, i] * sampled.weight[i] * state[i] / 2
        total = total + window[None, :, None, None] * np.outer(shape, shape.conj())
    return total
