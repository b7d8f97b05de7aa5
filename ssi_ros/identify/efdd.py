"""
Enhanced frequency domain decomposition beside the modes of a window, to compare with.

Around a mode the spectral matrix has one large singular value; its bell, as far as the singular
vectors stay alike, is that of a single degree of freedom. Back in time it is a decay, whose phase
gives the frequency and whose envelope the damping. Source: Brincker, Zhang and Andersen, Smart
Materials and Structures 10(3), 2001; Brincker, Ventura and Andersen, IMAC 19, 2001 (damping).
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.identify.shapes import mac

SEGMENT = 0.25          # of the window, half-overlapping: seven averages
NEAR = 0.01             # relative distance of the peak from the mode, or LINES lines
LINES = 2
ALIKE = 0.8             # least MAC with the mode, and along the bell with its peak
HIGH, LOW = 0.95, 0.3   # of the decay, between which it is fitted
LEAST = 5               # lags of it, and lines of the bell


@dataclass(frozen=True)
class Efdd:
    """
    A mode by enhanced frequency domain decomposition; NaN where there is no bell.

    Attributes
    ----------
    frequency_hz, damping_ratio : float
        Natural frequency [Hz], damping ratio [1].
    mac : float
        Of the singular vector at the peak with the shape of the mode.
    lines : int
        Of the bell.

    """

    frequency_hz: float = float('nan')
    damping_ratio: float = float('nan')
    mac: float = float('nan')
    lines: int = 0


def efdd(values, rate_hz, modes):
    """
    Decompose the spectral matrix of a window, and return what it says of modes.

    Parameters
    ----------
    values : ndarray, shape (n, l), [m/s^2]
        The window, evenly sampled; NaN where a sample is missing counts as the mean.
    rate_hz : float
        [Hz].
    modes : sequence of Mode
        Where to look, and for which shapes.

    Returns
    -------
    tuple of Efdd
        One a mode.

    Raises
    ------
    ValueError
        For a window of fewer than 64 samples.

    """
    size = int(SEGMENT * len(values)) // 2 * 2
    if size < 16:
        raise ValueError(f'{len(values)} samples given; 64 or more are needed')
    values = np.nan_to_num(values - np.nanmean(values, axis=0))
    taper = np.hanning(size + 2)[1:-1]
    begins = range(0, len(values) - size + 1, size // 2)
    lines = np.array([np.fft.rfft(taper[:, None] * values[b:b + size], axis=0) for b in begins])
    vectors, singular, _ = np.linalg.svd(np.einsum('ski,skj->kij', lines, lines.conj()))
    shapes = vectors.swapaxes(1, 2)                 # (k, j, l), of the j-th singular value
    # a taper makes every correlation decay; what it does is known, and taken out
    lag_window = np.fft.irfft(np.abs(np.fft.rfft(taper, 2 * size)) ** 2)[:size // 2]
    lag_window /= lag_window[0]
    return tuple(_of_mode(m, shapes, singular, rate_hz / size, lag_window) for m in modes)


def _of_mode(mode, shapes, singular, df, lag_window):
    """Return what the singular values, df [Hz] apart, say of one mode."""
    middle = round(mode.frequency_hz / df)
    reach = max(LINES, int(NEAR * mode.frequency_hz / df))
    near = np.arange(max(1, middle - reach), min(len(singular) - 1, middle + reach + 1))
    if not len(near):
        return Efdd()
    likeness = mac(mode.shape[None], shapes[near].reshape(-1, shapes.shape[-1]))[0].reshape(
        len(near), -1)
    height = np.where(likeness >= ALIKE, singular[near], 0.0)
    at, own = np.unravel_index(height.argmax(), height.shape)
    if height[at, own] == 0.0:
        return Efdd()
    peak, like = near[at], float(likeness[at, own])
    bell = {peak: singular[peak, own]}
    for step in (-1, 1):
        k = peak + step
        while 0 < k < len(singular):
            alike = mac(shapes[peak, own][None], shapes[k])[0]
            if alike.max() < ALIKE:
                break
            bell[k] = singular[k, alike.argmax()]
            k += step
    if len(bell) < LEAST:
        return Efdd(mac=like, lines=len(bell))
    frequencies = np.array(sorted(bell)) * df
    lags = np.arange(len(lag_window)) / (2 * df * len(lag_window))
    decay = np.array([bell[k] for k in sorted(bell)]) @ np.exp(
        2j * np.pi * frequencies[:, None] * lags) / lag_window
    envelope = np.abs(decay) / np.abs(decay[0])
    below = np.flatnonzero(envelope < LOW)
    end = below[0] if len(below) else len(envelope) * 3 // 4        # beyond, noise is raised
    begin = np.argmax(envelope < HIGH)
    if end - begin < LEAST:
        return Efdd(mac=like, lines=len(bell))
    t = lags[begin:end]
    rate = -np.polyfit(t, np.log(envelope[begin:end]), 1)[0]
    turn = np.polyfit(t, np.unwrap(np.angle(decay[begin:end])), 1)[0]
    natural = np.hypot(turn, rate)
    return Efdd(float(natural / (2 * np.pi)), float(rate / natural), like, len(bell))


def efdd_table(modes, found):
    """Return modes beside what `efdd` found of them, as text for the terminal."""
    lines = [f'{"id":>4}{"frequency [Hz]":>16}{"EFDD [Hz]":>12}{"off [%]":>9}'
             f'{"damping [%]":>13}{"EFDD [%]":>10}{"MAC":>7}{"lines":>7}']
    for m, e in sorted(zip(modes, found), key=lambda pair: pair[0].frequency_hz):
        own = f'{m.identity:>4}{m.frequency_hz:16.4f}'
        if e.frequency_hz != e.frequency_hz:
            lines.append(f'{own}{"no bell of its own":>21}{100 * m.damping_ratio:13.2f}')
            continue
        off = 100 * (e.frequency_hz / m.frequency_hz - 1)
        lines.append(f'{own}{e.frequency_hz:12.4f}{off:+9.2f}{100 * m.damping_ratio:13.2f}'
                     f'{100 * e.damping_ratio:10.2f}{e.mac:7.3f}{e.lines:7d}')
    return '\n'.join(lines)
