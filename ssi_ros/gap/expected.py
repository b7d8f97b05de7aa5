"""The expected periodogram of a setup: exact in the mean, taper and all, eq. (94) and (95)."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects.edits import scale_stiffness
from ssi_ros.gap.linearise import linearise, Rattle
from ssi_ros.model.disturbances import Chirp, Sine
from ssi_ros.model.excitation import Coloured, Varying, White
from ssi_ros.model.sensors import Noise

ROUNDING = 1e-6         # by which the poles of a rigid body may leave the unit circle


@dataclass(frozen=True, eq=False)
class Expected:
    """
    Expected periodograms, linear in the levels: S = fixed + sum_c level_c shares_c.

    Attributes
    ----------
    names : tuple of str
        Of the levels: each random part of the excitation, and the sensor noise.
    shares : tuple of ndarray, shape (a, k, l, l)
        One a level; a is 1, or the number of pieces where the pieces differ.
    fixed : ndarray, shape (a, k, l, l)
        What no level scales: lines, sweeps, slow noise of a channel.

    """

    names: tuple
    shares: tuple
    fixed: np.ndarray

    def at(self, levels):
        """Return S at the levels, shape (a, k, l, l)."""
        total = self.fixed
        for level, share in zip(levels, self.shares):
            total = total + level * share
        return total


def expected(setup, frame):
    """
    Compute the expected periodograms of a setup.

    The autocovariance of the sampled system is a sum of its poles, eq. (94); times the overlap
    of the taper with itself, its Fourier transform is the mean of the periodogram, leakage and
    aliases included. Source: Sykulski et al., Biometrika 106(2), 2019 (debiased Whittle).

    Parameters
    ----------
    setup : Setup
        Of `inject`; nonlinear hinges enter by their equivalent linear ones.
    frame : Frame
        How the record is cut.

    Returns
    -------
    Expected

    """
    if not setup.drift:
        return _steady(linearise(setup), frame)
    arrays = [a.name for a in setup.spacecraft.arrays]
    pieces = []
    for piece in range(frame.pieces):
        change = setup.drift * (piece + 0.5) * frame.rows / (setup.duration_s * frame.rate_hz)
        system = scale_stiffness(setup.system, arrays, 1.0 + change)
        pieces.append(_steady(linearise(replace(setup, system=system)), frame))

    def one(part, piece):
        return part[piece if len(part) > 1 else 0]

    shares = tuple(np.stack([one(e.shares[c], i) for i, e in enumerate(pieces)])
                   for c in range(len(pieces[0].shares)))
    return Expected(pieces[0].names, shares,
                    np.stack([one(e.fixed, i) for i, e in enumerate(pieces)]))


def _steady(setup, frame):
    system, rate_hz = setup.system, setup.system.rate_hz
    sampled = system.state_space.discrete(rate_hz)
    if np.abs(sampled.poles).max(initial=0.0) > 1 + ROUNDING:
        raise ValueError('the system is not stable; it has no expected spectrum')
    for row, column in setup.lags:
        sampled = sampled.with_lag(row, column)
    count = len(system.channels)
    names, shares = [], []
    fixed = np.zeros((1, frame.last - frame.first, count, count), complex)
    shake = _Shake(setup, frame, count)
    powers = _powers(sampled.poles, frame.rows - 1)
    for part in system.excitation:
        inner, colour = part, 1.0
        while isinstance(inner, (Varying, Coloured)):
            if isinstance(inner, Coloured):
                colour = inner.power(frame.frequencies_hz)[:, None, None]
            inner = inner.part
        if isinstance(inner, (Sine, Chirp)):
            fixed = fixed + shake(_line(inner, sampled, system, frame))
            continue
        share = shake(colour * _transform(_autocovariance(
            sampled, inner.covariance(rate_hz, system.inputs), powers), frame))
        share = share[None]
        swings = part.part if isinstance(part, Coloured) else part
        if isinstance(swings, Varying):
            share = share * _power(swings, frame)[:, None, None, None]
        if isinstance(inner, White):
            names.append(inner.name)
            shares.append(share)
        elif isinstance(inner, Rattle):
            shares[names.index(inner.name)] = shares[names.index(inner.name)] + share
        else:
            fixed = fixed + share
    white = np.zeros((1, 1, count, count))
    for stage in system.chain:
        gain = stage.response(np.zeros(1), count)[0]
        shares = [_through(gain, s) for s in shares]
        white, fixed = _through(gain, white), _through(gain, fixed)
        if isinstance(stage, Noise):
            white = white + stage.noise_covariance(count)
        elif hasattr(stage, 'autocovariance'):
            fixed = fixed + _transform(stage.autocovariance(count, frame.rows, rate_hz), frame)
    shares.append(np.broadcast_to(white * frame.overlap[0] + 0j, fixed[:1].shape))
    return Expected(tuple(names) + ('sensor_noise',), tuple(shares), fixed)


def _through(gain, spectrum):
    """Return G S G^T; most stages are diagonal, or do nothing."""
    own = np.diag(gain)
    if np.any(gain != np.diag(own)):
        return gain @ spectrum @ gain.T
    return spectrum if np.all(own == 1.0) else np.outer(own, own) * spectrum


def _powers(poles, count):
    """Return the powers 0, 1, ... of poles, shape (count, poles), as products of two tables."""
    logs = np.log(np.where(np.abs(poles) < 1e-300, 1e-300, poles))
    width = int(np.sqrt(count)) + 1
    fine, coarse = (np.exp(np.arange(width)[:, None] * step * logs) for step in (1, width))
    return (coarse[:, None] * fine[None]).reshape(-1, len(poles))[:count]


def _autocovariance(sampled, inputs, powers):
    """Return E[y(k + lag) y(k)^T] for lag = 0, 1, ..., shape (lags, l, l), eq. (94)."""
    live = np.flatnonzero(inputs.any(axis=0))
    pair = sampled.weight > 1
    q = inputs[np.ix_(live, live)]
    poles = np.concatenate([sampled.poles, sampled.poles[pair].conj()])
    b = np.vstack([sampled.b, sampled.b[pair].conj()])[:, live]
    c = np.hstack([sampled.c, sampled.c[:, pair].conj()])
    d = sampled.d[:, live]
    # A pole that takes over an hour to settle is no part of a stationary state, as in eq. (23).
    slow = 1 - np.abs(poles) < 1 / (3600 * sampled.rate_hz)
    away = np.where(slow[:, None] | slow[None, :], np.inf,
                    1 - poles[:, None] * poles.conj()[None, :])
    state = (b @ q @ b.conj().T) / away
    ahead = poles[:, None] * (state @ c.conj().T) + b @ q @ d.T        # E[z(k + 1) y(k)^T]
    kept = len(sampled.poles)
    count = len(c)
    # R(lag) = Re sum weight c_i pole_i^(lag - 1) ahead_i: one product for all lags
    residues = (sampled.weight[:, None, None] * c.T[:kept, :, None] * ahead[:kept, None, :])
    residues = residues.reshape(kept, count * count)
    out = np.empty((len(powers) + 1, count, count))
    out[1:] = (powers.real @ residues.real - powers.imag @ residues.imag).reshape(
        -1, count, count)
    out[0] = (c @ state @ c.conj().T).real + d @ q @ d.T
    return out


def _transform(autocovariance, frame):
    """Return the expected periodogram of an autocovariance, shape (k, l, l), eq. (95)."""
    half = np.fft.rfft(autocovariance * frame.overlap[:, None, None], axis=0)
    half = half[frame.first:frame.last]
    return half + half.conj().swapaxes(1, 2) - autocovariance[0] * frame.overlap[0]


def _power(part, frame):
    """Return the mean of (1 + depth sin)^2 over every piece, weighted by its taper, (pieces,)."""
    t = np.arange(frame.pieces * frame.rows) / frame.rate_hz
    level = part.level(t) ** 2
    return level.reshape(frame.pieces, frame.rows) @ frame.taper ** 2


def _line(part, sampled, system, frame):
    """Return the periodogram of a sine or a sweep of unknown phase, ([pieces,] k, l, l)."""
    where = system.inputs.index(part.input)
    phase = 2j * np.pi / frame.rows * np.arange(frame.first, frame.last)
    n = np.arange(frame.rows)
    if isinstance(part, Sine):
        turn = 2j * np.pi * part.frequency_hz / sampled.rate_hz
        response = sampled.response(np.exp([turn]))[0][:, where] * part.amplitude / 2
        window = np.abs(np.fft.fft(frame.taper * np.exp(turn * n))) ** 2
        return (window[frame.first:frame.last, None, None]
                * np.outer(response, response.conj())[None])
    response = sampled.response(np.exp(phase))[:, :, where]
    drive = part.at(np.arange(frame.pieces * frame.rows), sampled.rate_hz)
    drive = np.fft.fft(drive.reshape(frame.pieces, frame.rows) * frame.taper, axis=1)
    power = np.abs(drive[:, frame.first:frame.last]) ** 2
    return power[:, :, None, None] * (response[:, :, None] * response[:, None, :].conj())[None]


class _Shake:
    """What delays and jitter of the sampling instants do to a spectrum, eq. (89)."""

    def __init__(self, setup, frame, count):
        turn = 2 * np.pi * setup.system.rate_hz / frame.rows
        omega = turn * np.arange(frame.first, frame.last)
        self.phase = self.loss = None
        if any(setup.delays_s) or setup.corners_hz:
            read = setup.reading(omega / (2 * np.pi))
            self.phase = read[:, :, None] * read[:, None, :].conj()
        if setup.jitter_rms_s:
            self.loss = np.exp(-(omega * setup.jitter_rms_s) ** 2)[:, None, None]
            self.share = 2.0 / frame.rows

    def __call__(self, spectrum):
        if self.phase is not None:
            spectrum = spectrum * self.phase
        if self.loss is not None:
            # what leaves the spectrum by jitter comes back white, the same instants for all
            white = self.share * np.sum(((1 - self.loss) * spectrum).real, axis=-3, keepdims=True)
            spectrum = spectrum * self.loss + white
        return spectrum
