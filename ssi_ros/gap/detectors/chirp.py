"""A sine of the input whose frequency changes linearly: by segments, then coherently, (107)."""
import numpy as np
from scipy.fft import fft, next_fast_len

from ssi_ros.arrays import phasors
from ssi_ros.effects.registry import deflection, detects
from ssi_ros.events.track import best_lines, stds_of_ends
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors.thresholds import LIMITS
from ssi_ros.scipy_later import minimize
from ssi_ros.tails import tail_of_highest_in_plane

SEGMENTS = 10           # of the record, each coherent in itself in the first search,
SEGMENT_S = 66.0        # but no longer ones: that search would grow as the square of the record
OFF_GRID = 1.5          # times the power on the grid, which a chirp near it has at most
KEPT = 12               # rates and starts of the first search that are refined
FINE = 2                # bins of a segment are so much closer than 1 / its length
TOGETHER = 1 << 19      # values that are transformed at once
CLIPPED = 6.0           # standard deviations, at which an impulse is cut
LOUD = 40.0             # means of the power, at which a line is cut


@detects('wheel_speed_sweep', of='input')
def detect_chirp(effect, reconstruction):
    """Detect the strongest linear chirp over the whole record."""
    one = reconstruction
    unit = np.clip(np.where(one.missing, 0.0, one.series(values=one.machine)), -CLIPPED, CLIPPED)
    unit[:one.inside.start], unit[one.inside.stop:] = 0.0, 0.0
    duration_s = one.rows / one.rate_hz
    frequencies = (one.first + np.arange(len(one.values))) / duration_s
    gain = one.machine_gain * np.sqrt(one.rows / (2 * len(one.values)))

    def weight(start, rate):
        t = np.arange(one.rows) / one.rate_hz
        return np.where(one.missing, 0.0, np.interp(start + rate * t, frequencies, gain))

    trials = (frequencies[-1] * duration_s) ** 2
    power, start, end = max((
        _refined(unit, weight, *near, one.rate_hz, duration_s, trials)
        for near in _candidates(unit, one.rate_hz, frequencies[[0, -1]])), default=(0.0, 0.0, 0.0))
    p_value = tail_of_highest_in_plane(power, trials)
    if (p_value > LIMITS.p_value.value
            or abs(end - start) * duration_s < LIMITS.least_cycles.value):
        return None
    size = np.sqrt(2 * power)
    amplitude = _amplitude(one, unit, start, (end - start) / duration_s)
    stds = stds_of_ends(weight(start, (end - start) / duration_s)[one.inside], duration_s)
    return Detection.of_effect(
        effect.within(start_hz=start, end_hz=end, torque_n_m=amplitude), p_value,
        f'The input has a chirp from {start:.4g} to {end:.4g} Hz ({size:.1f} standard '
        'deviations).', trials=round(trials),
        stds={'start_hz': stds[0] / size, 'end_hz': stds[1] / size,
              'torque_n_m': amplitude / size})


@deflection('wheel_speed_sweep')
def chirp_deflection(effect, sensitivity):
    """Return d' of a chirp."""
    return sensitivity.of_sine(effect.torque_n_m, *sorted((effect.start_hz, effect.end_hz)))


def _candidates(unit, rate_hz, band):
    """Return the rates and starts [Hz/s, Hz] of the best sums of power along straight lines."""
    count = _segments(len(unit) / rate_hz)
    rows = len(unit) // count
    segments = unit[:rows * count].reshape(count, rows).astype(np.float32)
    length_s = rows / rate_hz
    t = (np.arange(rows) - rows / 2) / rate_hz
    middles = (np.arange(count) + 0.5) * length_s
    size = next_fast_len(FINE * rows)
    df = rate_hz / size
    highest = (band[1] - band[0]) / (count * length_s)
    coarse = 2 / length_s ** 2             # 0.8 rad at the ends of a segment, half of it
    fine = df / (count * length_s)
    inner = np.arange(-int(coarse / fine / 2) - 1, int(coarse / fine / 2) + 1) * fine
    first, last = int(band[0] / df), int(band[1] / df)
    found = []
    for rate in np.arange(coarse / 2, highest + coarse, coarse):
        turn = phasors((rate / 2 * t ** 2).astype(np.float32))
        both = fft(segments * turn, size, axis=1, overwrite_x=True)
        # of a real series what falls is at negative frequencies of what rises
        for way, half in ((rate, both[:, :last]), (-rate, both[:, :-last:-1])):
            power = (half.real ** 2 + half.imag ** 2) / np.float32(rows)
            if way < 0:
                power = np.hstack([power[:, :1], power])
            # one strong bin is a line; it must not stand for all segments
            power = np.minimum(power, np.float32(LOUD))
            shifts = np.rint((way + inner)[:, None] * middles / df).astype(np.int64)
            found.append((*best_lines(power, shifts, first, last), way + inner))
    tops, starts, rates = map(np.concatenate, zip(*found))
    kept, best = [], np.argsort(-tops, kind='stable')[:np.count_nonzero(starts >= 0)]
    for rate, start in zip(rates[best], starts[best] * df):
        if all(abs(rate - r) * count * length_s + abs(start - s) > 3 / length_s
               for r, s in kept):
            kept.append((rate, start))
        if len(kept) == KEPT:
            break
    return kept


def _segments(duration_s):
    return max(SEGMENTS, round(duration_s / SEGMENT_S))


def _amplitude(one, unit, start, rate):
    """Return the amplitude of a chirp, with the responses of the modes that it has passed."""
    t = np.arange(one.rows) / one.rate_hz
    wave = np.exp(2j * np.pi * (start * t + rate * t ** 2 / 2))
    bins = slice(one.first, one.first + len(one.values))
    columns = np.column_stack([
        one.series(values=one.machine_gain * np.fft.rfft(one.taper * w)[bins])
        for w in (wave.real, wave.imag)])[one.inside]
    columns = columns * ~one.missing[one.inside, None]
    found, *_ = np.linalg.lstsq(columns, unit[one.inside], rcond=None)
    noise = np.sqrt(np.linalg.inv(columns.T @ columns)[0, 0])
    return float(np.sqrt(max(found @ found - 2 * noise ** 2, 0.0)))


def _refined(unit, weight, rate, start, rate_hz, duration_s, trials):
    """Return power, first and last frequency of the best coherent chirp near by."""
    t = np.arange(len(unit)) / rate_hz
    weights = weight(start, rate)
    total = np.sum(weights ** 2)
    cycles = start * t + rate * t ** 2 / 2
    turned = unit * weights * phasors((cycles - np.rint(cycles)).astype(np.float32))
    # close to zero frequency now, so means over a second are enough
    block = max(1, int(rate_hz))
    rows = len(unit) // block
    slow = turned[:rows * block].reshape(rows, block).sum(axis=1)
    t = (np.arange(rows) + 0.5) * block / rate_hz
    reach = 4 * _segments(duration_s) / FINE / duration_s     # of both ends, [Hz]
    size = 4 * next_fast_len(rows)
    shifts = np.fft.fftfreq(size, block / rate_hz)
    best = (0.0, start, start + rate * duration_s)
    steps = np.arange(-reach, reach, 0.4 / duration_s) / duration_s
    near, slow_of = np.flatnonzero(np.abs(shifts) <= 2 * reach), slow.astype(np.complex64)
    for some in np.array_split(steps, -(-len(steps) * size // TOGETHER)):
        # where the search goes on from, so that single precision will do
        turn = phasors((some[:, None] / 2 * t ** 2).astype(np.float32))
        power = np.abs(fft(slow_of * turn, size, axis=1, overwrite_x=True)[:, near]) ** 2 / total
        row, top = np.unravel_index(np.argmax(power), power.shape)
        if power[row, top] > best[0]:
            first = start + shifts[near[top]]
            best = (float(power[row, top]), first, first + (rate + some[row]) * duration_s)

    # off the grid it is a few per cent more: by far not enough to make chance a chirp
    if tail_of_highest_in_plane(OFF_GRID * best[0], trials) > LIMITS.p_value.value:
        return best

    def negative_power(ends):
        first, last = best[1] + ends[0] / duration_s, best[2] + ends[1] / duration_s
        turn = (first - start) * t + ((last - first) / duration_s - rate) * t ** 2 / 2
        return -np.abs(slow @ phasors(turn)) ** 2 / total

    found = minimize(negative_power, np.zeros(2), method='Nelder-Mead', options={
        'initial_simplex': 0.3 * np.array([[0, 0], [1, 0], [0, 1]]), 'xatol': 1e-3})
    return (-found.fun, *(end + x / duration_s for end, x in zip(best[1:], found.x)))
