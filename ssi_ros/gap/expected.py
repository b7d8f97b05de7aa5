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
    near : tuple of ndarray, optional
        Where the linear equivalents of nonlinear hinges stand, `Setup.near`.

    """

    names: tuple
    shares: tuple
    fixed: np.ndarray
    near: tuple = None

    def at(self, levels):
        """Return S at the levels, shape (a, k, l, l)."""
        total = self.fixed
        for level, share in zip(levels, self.shares):
            total = total + level * share
        return total


def expected(setup, frame, lively=None):
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
    lively : Lively, optional
        What motion of the record made noise; without it that is taken from its mean, eq. (95b).

    Returns
    -------
    Expected

    """
    if not setup.drift:
        return _steady(linearise(setup), frame, lively)
    arrays = [a.name for a in setup.spacecraft.arrays]
    pieces = []
    for piece in range(frame.pieces):
        change = setup.drift * (piece + 0.5) * frame.rows / (setup.duration_s * frame.rate_hz)
        system = scale_stiffness(setup.system, arrays, 1.0 + change)
        pieces.append(_steady(linearise(replace(setup, system=system)), frame, lively))

    def one(part, piece):
        return part[piece if len(part) > 1 else 0]

    shares = tuple(np.stack([one(e.shares[c], i) for i, e in enumerate(pieces)])
                   for c in range(len(pieces[0].shares)))
    return Expected(pieces[0].names, shares,
                    np.stack([one(e.fixed, i) for i, e in enumerate(pieces)]))


def _steady(setup, frame, lively):
    system, rate_hz = setup.system, setup.system.rate_hz
    sampled = system.state_space.discrete(rate_hz)
    if np.abs(sampled.poles).max(initial=0.0) > 1 + ROUNDING:
        raise ValueError('the system is not stable; it has no expected spectrum')
    for row, column in setup.lags:
        sampled = sampled.with_lag(row, column)
    count = len(system.channels)
    names, shares = [], []
    fixed = np.zeros((1, frame.last - frame.first, count, count), complex)
    shake = _Shake(setup, frame, lively)
    powers = _powers(sampled.poles, frame.rows - 1)
    for part in system.excitation:
        inner, colour, level = part, 1.0, None
        while isinstance(inner, (Varying, Coloured)):
            if isinstance(inner, Coloured):
                colour = inner.power(frame.frequencies_hz)[:, None, None]
            else:
                level = inner
            inner = inner.part
        if isinstance(inner, (Sine, Chirp)):
            fixed = fixed + shake(_line(inner, sampled, system, frame), inner)
            continue
        covariance = inner.covariance(rate_hz, system.inputs)
        if level is None:
            share = _transform(_autocovariance(sampled, covariance, powers), frame.overlap,
                               frame)[None]
        else:
            share = _swinging(level, sampled, covariance, powers, frame)
        share = shake(colour * share, inner)
        if isinstance(inner, White):
            names.append(inner.name)
            shares.append(share)
        elif isinstance(inner, Rattle):
            shares[names.index(inner.name)] = shares[names.index(inner.name)] + share
        else:
            fixed = fixed + share
    fixed = fixed + shake.noise
    white = np.zeros((1, 1, count, count))
    for stage in system.chain:
        gain = stage.response(np.zeros(1), count)[0]
        shares = [_through(gain, s) for s in shares]
        white, fixed = _through(gain, white), _through(gain, fixed)
        if isinstance(stage, Noise):
            white = white + stage.noise_covariance(count)
        elif hasattr(stage, 'autocovariance'):
            fixed = fixed + _transform(
                stage.autocovariance(count, frame.rows, rate_hz), frame.overlap, frame)
    shares.append(np.broadcast_to(white * frame.overlap[0] + 0j, fixed[:1].shape))
    return Expected(tuple(names) + ('sensor_noise',), tuple(shares), fixed, setup.near)


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


def _autocovariance(sampled, inputs, powers, turn=1.0):
    """
    Return E[y(k + lag) y(k)^T] for lag = 0, 1, ..., shape (lags, l, l), eq. (94).

    With `turn` not 1 the part of it, complex, that goes with turn^k where the inputs do, (95a).
    """
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
                    turn - poles[:, None] * poles.conj()[None, :])
    state = (b @ q @ b.conj().T) / away
    ahead = poles[:, None] * (state @ c.conj().T) + b @ q @ d.T        # E[z(k + 1) y(k)^T]
    kept = len(sampled.poles)
    count = len(c)
    now = c @ state @ c.conj().T + d @ q @ d.T
    # R(lag) = sum c_i pole_i^(lag - 1) ahead_i: one product for all lags
    residues = (c.T[:, :, None] * ahead[:, None, :]).reshape(-1, count * count)
    if turn == 1.0:
        # poles in pairs: twice the real part of one of them
        residues = sampled.weight[:, None] * residues[:kept]
        out = np.empty((len(powers) + 1, count, count))
        out[1:] = (powers.real @ residues.real - powers.imag @ residues.imag).reshape(
            -1, count, count)
        out[0] = now.real
        return out
    later = powers @ residues[:kept] + powers[:, pair].conj() @ residues[kept:]
    return np.concatenate([now[None], later.reshape(-1, count, count)])


def _swinging(level, sampled, inputs, powers, frame):
    """
    Return the expected periodograms under inputs of a swinging level, (pieces, k, l, l).

    The square of the level has three parts, of 0, 1 and 2 times its frequency; a slow mode
    follows each with a lag of its own, eq. (95a).
    """
    begins = np.arange(frame.pieces) * frame.rows / frame.rate_hz
    omega = 2 * np.pi / level.period_s
    once = level.depth * np.exp(1j * (level.phase_rad - np.pi / 2))
    tapered = np.fft.fft(frame.taper, 2 * frame.rows)
    whole = np.fft.ifft(np.abs(tapered) ** 2).real[:frame.rows]
    thinned = frame.overlap / np.maximum(whole, 1e-12 * whole[0])     # by rows that are missing
    total = (1 + level.depth ** 2 / 2) * _transform(
        _autocovariance(sampled, inputs, powers), frame.overlap, frame)[None]
    for times, part in ((1, once), (2, once ** 2 / 4)):
        turn = np.exp(1j * times * omega / frame.rate_hz)
        turned = np.fft.fft((frame.taper * turn ** np.arange(frame.rows)).conj(), 2 * frame.rows)
        overlap = np.fft.ifft(turned.conj() * tapered)[:frame.rows] * thinned
        values = 2 * part * overlap[:, None, None] * _autocovariance(
            sampled, inputs, powers, turn)
        phase = np.exp(1j * times * omega * begins)[:, None, None, None]
        total = (total + phase.real * _transform(values.real, 1.0, frame)
                 - phase.imag * _transform(values.imag, 1.0, frame))
    return total


def _transform(autocovariance, overlap, frame):
    """Return the expected periodogram of an autocovariance, shape (k, l, l), eq. (95)."""
    values = autocovariance * np.reshape(overlap, (-1, 1, 1))
    half = np.fft.rfft(values, axis=0)[frame.first:frame.last]
    return half + half.conj().swapaxes(1, 2) - values[0]


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

    def __init__(self, setup, frame, lively):
        turn = 2 * np.pi * setup.system.rate_hz / frame.rows
        omega = turn * np.arange(frame.first, frame.last)
        self.phase = self.loss = None
        if any(setup.delays_s) or setup.corners_hz:
            read = setup.reading(omega / (2 * np.pi))
            self.phase = read[:, :, None] * read[:, None, :].conj()
        if setup.jitter_rms_s:
            self.loss = np.exp(-(omega * setup.jitter_rms_s) ** 2)[:, None, None]
            self.share = 2.0 / frame.rows
        self.lively, self.noise = lively, 0.0

    def __call__(self, spectrum, part):
        if self.phase is not None:
            spectrum = spectrum * self.phase
        if self.loss is not None:
            # what leaves the spectrum by jitter comes back white, the same instants for all
            white = self.share * np.sum(((1 - self.loss) * spectrum).real, axis=-3, keepdims=True)
            spectrum = spectrum * self.loss
            if self.lively is None:
                return spectrum + white
            # the record tells what became noise: no level scales it
            self.noise = self.noise + self.lively.of(part, white)
        return spectrum
