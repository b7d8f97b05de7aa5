"""Search a torque for a sine of linearly changing frequency: piecewise, then coherently (107)."""
import numpy as np
from scipy.fft import fft, next_fast_len
from scipy.optimize import minimize

from ssi_ros.effects import effect_class
from ssi_ros.gap.symptoms import SURE, Symptom, within
from ssi_ros.gap.tracks import best_lines

PIECES = 10             # of the record, each coherent in itself in the first search
KEPT = 12               # places of the first search that are refined
FINE = 2                # bins of a piece are so much closer than 1 / its length


def sweep(torque):
    """
    Find the strongest linear sweep over a whole record.

    Parameters
    ----------
    torque : Torque
        Of the record.

    Returns
    -------
    Symptom or None

    """
    unit = torque.series()
    unit[:torque.inside.start], unit[torque.inside.stop:] = 0.0, 0.0
    unit = np.clip(unit, -6.0, 6.0)             # a pulse is no sweep
    duration_s = torque.rows / torque.rate_hz
    bins = torque.first + np.arange(len(torque.values))
    frequencies = bins * torque.rate_hz / torque.rows
    gain = torque.gain * np.sqrt(torque.rows / (2 * len(torque.values)))

    def weight(start, rate):
        t = np.arange(torque.rows) / torque.rate_hz
        return np.interp(start + rate * t, frequencies, gain)

    best = (0.0, 0.0, 0.0)
    for rate, start in _places(unit, torque.rate_hz, frequencies[[0, -1]]):
        best = max(best, _refined(unit, weight, rate, start, torque.rate_hz, duration_s))
    power, start, end = best
    cells = (frequencies[-1] * duration_s) ** 2
    # maxima of a field over a plane: so many more than independent cells
    p = float(min(1.0, cells * max(power, 1.0) * np.exp(-power)))
    if p > SURE or abs(end - start) * duration_s < 3.0:     # that would be a line
        return None
    size = np.sqrt(2 * power)
    amplitude = _amplitude(torque, unit, start, (end - start) / duration_s)
    # the ends of a parabola through phases are four times as uncertain as a slope is
    spread = 4 * np.sqrt(6) / np.pi / duration_s / size
    return Symptom(within(
        effect_class('wheel_speed_sweep'), start_hz=start, end_hz=end, torque_n_m=amplitude), p,
        f'a sweep from {start:.4g} to {end:.4g} Hz, {size:.1f} sd',
        {'start_hz': spread, 'end_hz': spread, 'torque_n_m': amplitude / size})


def _places(unit, rate_hz, band):
    """Return the rates and starts [Hz/s, Hz] of the best sums of power along straight lines."""
    rows = len(unit) // PIECES
    pieces = unit[:rows * PIECES].reshape(PIECES, rows).astype(np.float32)
    length_s = rows / rate_hz
    t = (np.arange(rows) - rows / 2) / rate_hz
    middles = (np.arange(PIECES) + 0.5) * length_s
    size = next_fast_len(FINE * rows)
    df = rate_hz / size
    highest = (band[1] - band[0]) / (PIECES * length_s)
    coarse = 1.5 / length_s ** 2           # 0.6 rad at the ends of a piece, half of it
    fine = df / (PIECES * length_s)
    inner = np.arange(-int(coarse / fine / 2) - 1, int(coarse / fine / 2) + 1) * fine
    first, last = int(band[0] / df), int(band[1] / df)
    found = []
    for rate in np.arange(-highest, highest + coarse, coarse):
        turn = np.exp(-1j * np.pi * rate * t ** 2).astype(np.complex64)
        power = np.abs(fft(pieces * turn, size, axis=1)[:, :last]) ** 2 / np.float32(rows)
        # one strong bin is a line; it must not stand for all pieces
        power = np.minimum(power, np.float32(40.0))
        shifts = np.rint((rate + inner)[:, None] * middles / df).astype(np.int64)
        tops, starts = best_lines(power, shifts, first, last)
        found += [(top, rate + more, start * df)
                  for top, more, start in zip(tops, inner, starts) if start >= 0]
    kept = []
    for _, rate, start in sorted(found, reverse=True):
        if all(abs(rate - r) * PIECES * length_s + abs(start - s) > 3 / length_s for r, s in kept):
            kept.append((rate, start))
        if len(kept) == KEPT:
            break
    return kept


def _amplitude(torque, unit, start, rate):
    """Return the amplitude of a sweep, whose modes still ring where it has passed them."""
    t = np.arange(torque.rows) / torque.rate_hz
    wave = np.exp(2j * np.pi * (start * t + rate * t ** 2 / 2))
    bins = slice(torque.first, torque.first + len(torque.values))
    columns = np.column_stack([
        torque.series(values=torque.gain * np.fft.rfft(torque.taper * w)[bins])
        for w in (wave.real, wave.imag)])[torque.inside]
    found, *_ = np.linalg.lstsq(columns, unit[torque.inside], rcond=None)
    noise = np.sqrt(np.linalg.inv(columns.T @ columns)[0, 0])
    return float(np.sqrt(max(found @ found - 2 * noise ** 2, 0.0)))


def _refined(unit, weight, rate, start, rate_hz, duration_s):
    """Return power, first and last frequency of the best coherent sweep near by."""
    t = np.arange(len(unit)) / rate_hz
    weights = weight(start, rate)
    total = np.sum(weights ** 2)
    turned = unit * weights * np.exp(-2j * np.pi * (start * t + rate * t ** 2 / 2))
    # close to zero frequency now, so means over a second are enough
    block = int(rate_hz)
    rows = len(unit) // block
    slow = turned[:rows * block].reshape(rows, block).sum(axis=1)
    t = (np.arange(rows) + 0.5) * block / rate_hz
    reach = 4 * PIECES / FINE / duration_s              # of both ends, [Hz]
    size = 4 * next_fast_len(rows)
    df = rate_hz / block / size
    shifts = np.fft.fftfreq(size, 1 / size) * df
    best = (0.0, start, start + rate * duration_s)
    for more in np.arange(-reach, reach, 0.4 / duration_s) / duration_s:
        power = np.abs(np.fft.fft(slow * np.exp(-1j * np.pi * more * t ** 2), size)) ** 2 / total
        power[np.abs(shifts) > 2 * reach] = 0.0
        top = int(np.argmax(power))
        if power[top] > best[0]:
            first = start + shifts[top]
            best = (float(power[top]), first, first + (rate + more) * duration_s)

    def missed(ends):
        first, last = best[1] + ends[0] / duration_s, best[2] + ends[1] / duration_s
        turn = (first - start) * t + ((last - first) / duration_s - rate) * t ** 2 / 2
        return -np.abs(np.sum(slow * np.exp(-2j * np.pi * turn))) ** 2 / total

    found = minimize(missed, np.zeros(2), method='Nelder-Mead', options={
        'initial_simplex': 0.3 * np.array([[0, 0], [1, 0], [0, 1]]), 'xatol': 1e-3})
    return (-found.fun, *(end + x / duration_s for end, x in zip(best[1:], found.x)))
