"""
Expected periodograms of recorded inputs u and of the channels less a prediction, eq. (189).

With r = y - H_0 u, H_0 of the model before any effect, a model with the transfer H has the cross
spectrum (H - H_0) S_u of r and u. S_u is that of the record. Leakage comes from the difference of
the transfers alone: where the model is right, nothing leaks.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.spectra.expected_periodogram import (
    autocovariance, Expected, steady, transform)
from ssi_ros.model.spectrum import gains_of
from ssi_ros.model.statespace import powers_of


def expected_beside(setup, frame, recorded):
    """
    Compute the Expected of a steady setup, the recorded inputs before the channels.

    Parameters
    ----------
    setup : Setup
        Without drift; what is recorded is no part of its excitation.
    frame : Frame
        How the record is cut.
    recorded : RecordedInputs
        The inputs.

    Returns
    -------
    Expected
        Of m + l channels, of l where the inputs are not shown.

    """
    setup, names = recorded.linear(setup)
    rest = _without(steady(setup, frame, None), names)
    change, own = _response(setup, frame, recorded)
    spectrum = recorded.spectrum(frame)
    cross = change @ spectrum
    if recorded.exact:
        own = own + cross @ change.conj().swapaxes(1, 2)
    if not recorded.shown:
        return replace(rest, fixed=rest.fixed + own)
    m, both = recorded.count, recorded.count + len(setup.system.channels)
    fixed = np.zeros((len(rest.fixed), len(cross), both, both), complex)
    fixed[..., :m, :m], fixed[..., m:, :m] = spectrum, cross
    fixed[..., :m, m:] = cross.conj().swapaxes(1, 2)
    fixed[..., m:, m:] = rest.fixed + own
    return Expected(rest.names, tuple(_padded(s, m) for s in rest.shares), fixed, rest.near)


def _without(expected, names):
    """Return an Expected without levels of some names; what has them is fixed."""
    if not names:
        return expected
    kept = [i for i, n in enumerate(expected.names) if n not in names]
    fixed = expected.fixed + sum(s for n, s in zip(expected.names, expected.shares) if n in names)
    return replace(expected, names=tuple(expected.names[i] for i in kept),
                   held=tuple(expected.held[i] for i in kept), fixed=fixed)


def _padded(share, m):
    """Return a share of the channels with rows and columns of m inputs before."""
    return np.pad(share, ((0, 0), (0, 0), (m, 0), (m, 0)))


def _response(setup, frame, recorded):
    """
    Return how the inputs reach the channels, less the prediction, (k, l, m), and a spectrum.

    That is what of the channels does not follow the same bin of the inputs, (k, l, l): leakage,
    and the noise that jitter makes of their motion.
    """
    system = setup.system
    sampled, gains = sampled_of(setup), gains_of(system)
    read, kept = _reading(setup, frame)
    change = read[:, :, None] * _mean_transfer(sampled, system, recorded.names, frame)
    change = gains @ change
    before = None
    if recorded.anchor is not None:
        before = recorded.anchor
        key = 'anchor', frame.rows, frame.first, frame.last, frame.overlap[1:9].tobytes()
        if key not in recorded.known:
            recorded.known[key] = gains_of(before.system) @ _mean_transfer(
                sampled_of(before), before.system, recorded.names, frame)
        change = change - recorded.known[key]
    own, power = 0.0, np.einsum('kii->ik', recorded.spectrum(frame)).real
    for i, name in enumerate(recorded.names):
        if recorded.exact:
            spread = _spread(setup, before, name, frame, read)
            square = change[:, :, i, None] * change[:, None, :, i].conj()
            own = own + power[i][:, None, None] * (spread - square)
        if kept is not None:
            where = system.inputs.index(name)
            unit = _driven(sampled, where, frame)
            lost = power[i][:, None, None] * (1 - kept ** 2)[:, None, None] * unit
            own = own + gains @ (2.0 / frame.rows * lost.real.sum(axis=0)) @ gains.T
    return change, own


def _spread(setup, before, name, frame, read):
    """Return the spectrum of the difference to the prediction under one white input, (k, l, l)."""
    system, gains = setup.system, gains_of(setup.system)
    sampled, where = sampled_of(setup), setup.system.inputs.index(name)
    plain = np.all(read == 1.0)
    if before is None:
        found = _driven(replace(sampled, c=gains @ sampled.c, d=gains @ sampled.d)
                        if plain else sampled, where, frame)
        turn = read[:, :, None] * np.eye(len(system.channels)) if not plain else None
        return found if plain else (gains @ turn) @ found @ (
            gains @ turn).conj().swapaxes(1, 2)
    other, at = sampled_of(before), before.system.inputs.index(name)
    own = gains_of(before.system)
    poles = np.concatenate([sampled.poles, other.poles])
    weight = np.concatenate([sampled.weight, other.weight])
    b = np.concatenate([sampled.b[:, where], other.b[:, at]])[:, None]
    if plain:
        both = replace(
            sampled, poles=poles, weight=weight, b=b,
            c=np.hstack([gains @ sampled.c, -own @ other.c]),
            d=(gains @ sampled.d[:, where] - own @ other.d[:, at])[:, None])
        return _driven(both, 0, frame)
    empty = np.zeros_like
    both = replace(
        sampled, poles=poles, weight=weight, b=b,
        c=np.block([[sampled.c, empty(other.c, shape=(len(sampled.c), other.c.shape[1]))],
                    [empty(sampled.c, shape=(len(other.c), sampled.c.shape[1])), own @ other.c]]),
        d=np.concatenate([sampled.d[:, where], own @ other.d[:, at]])[:, None])
    turn = np.concatenate([gains * read[:, None, :], np.broadcast_to(
        -np.eye(len(own)), (len(read), len(own), len(own)))], axis=2)
    return turn @ _driven(both, 0, frame) @ turn.conj().swapaxes(1, 2)


def _driven(sampled, where, frame):
    """Return the expected periodogram under one white input of unit variance, (k, l, l)."""
    one = replace(sampled, b=sampled.b[:, [where]], d=sampled.d[:, [where]])
    powers = powers_of(one.poles, frame.rows - 1)
    return transform(autocovariance(one, np.eye(1), powers), frame.overlap, frame)


def _mean_transfer(sampled, system, names, frame):
    """Return the transfer from inputs to channels as the taper averages it, (k, l, m)."""
    columns = [system.inputs.index(n) for n in names]
    b, c, d = sampled.b[:, columns], sampled.c * sampled.weight, sampled.d[:, columns]
    powers = powers_of(sampled.poles, frame.rows - 1)
    residues = (c.T[:, :, None] * b[:, None, :]).reshape(len(b), -1)
    impulse = np.empty((frame.rows, *d.shape))
    impulse[0] = d
    impulse[1:] = (powers.real @ residues.real - powers.imag @ residues.imag).reshape(
        -1, *d.shape)
    tapered = impulse * frame.overlap[:, None, None]
    return np.fft.rfft(tapered, axis=0)[frame.first:frame.last]


def sampled_of(setup):
    """Return the sampled system of a linear setup."""
    sampled = setup.system.state_space.discrete(setup.system.rate_hz)
    for row, column in setup.lags:
        sampled = sampled.with_lag(row, column)
    return sampled


def _reading(setup, frame):
    """Return what delays, low-passes and jitter keep of a channel, (k, l), and of jitter, (k,)."""
    frequencies_hz = np.arange(frame.first, frame.last) * setup.system.rate_hz / frame.rows
    read, kept = np.ones((len(frequencies_hz), len(setup.system.channels)), complex), None
    if any(setup.delays_s) or setup.corners_hz:
        read = setup.reading(frequencies_hz)
    if setup.jitter_rms_s:
        kept = np.exp(-(2 * np.pi * frequencies_hz * setup.jitter_rms_s) ** 2 / 2)
        read = read * kept[:, None]
    return read, kept
