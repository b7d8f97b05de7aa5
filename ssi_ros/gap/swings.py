"""Search what drives a record for a swing of its level: a sine in its magnitude, eq. (109)."""
import numpy as np
from scipy.optimize import minimize_scalar

from ssi_ros.effects import effect_class
from ssi_ros.gap.symptoms import chance, SURE, Symptom, within

SLOWEST = 0.7           # periods of the level that a record must hold
MAGNITUDE = 4.5         # medians of the magnitude (3 sd) at which a sample is cut for the level
FASTEST_HZ = 1.0        # of a swing of the level that is looked for
# Of a level that wanders by itself: at least so many cells wide, or a slow swing would be taken
# for it, and so much more likely than a steady one.
WIDE, LIKELIER = 12, 4.0
CORNERS, RATIOS = 8, np.append(0.0, np.geomspace(0.5, 64.0, 15))
LINE = 6.0              # means above which a cell is a line and tells nothing of the rest


def swing(torque):
    """Find the strongest sinusoidal swing of the level of all that excites, eq. (109)."""
    level = _magnitude(torque)
    count = len(level)
    longest = count / torque.rate_hz / SLOWEST
    coarse, at, block = _coarse(level, torque.rate_hz)
    rows = len(coarse)
    spread = np.var(level) / block
    size = 8 * rows
    df = torque.rate_hz / block / size
    gains = np.abs(np.fft.rfft(coarse - coarse.mean(), size)) ** 2 / (rows * spread)
    frequencies = np.arange(len(gains)) * df
    # few periods: sine and mean are not orthogonal, so these are fitted one by one
    low, few = int(np.ceil(1 / longest / df)), int(4 / df * torque.rate_hz / count)
    gains[low:few] = [_sine_fit(coarse, at, f)[0] / (2 * spread) for f in frequencies[low:few]]
    gains[:low], gains[frequencies > FASTEST_HZ] = 0.0, 0.0
    gains /= _by_chance(coarse, at, spread, frequencies[np.argmax(gains)])(frequencies)
    best = int(np.argmax(gains))
    cells = 4 * FASTEST_HZ * count / torque.rate_hz
    p = chance(gains[best], cells)
    if p > SURE:
        return None
    frequency = _strongest(coarse, at, frequencies[best - 1], frequencies[best + 1])
    cosine, sine = _swing_of(coarse, at, frequency)
    size = np.sqrt(2 * gains[best])
    period = 1 / frequency
    # once more, so that crests are not cut for being crests
    turns = 2 * np.pi * np.arange(count) / torque.rate_hz / period
    level = _magnitude(torque, 1 + min(1, 0.95 / np.hypot(cosine, sine)) * (
        cosine * np.cos(turns) + sine * np.sin(turns)))
    cosine, sine = _swing_of(_coarse(level, torque.rate_hz)[0], at, frequency)
    depth = _undiluted(np.hypot(cosine, sine), torque.excited)
    phase = np.arctan2(cosine, sine) - 2 * np.pi * torque.inside.start / torque.rate_hz / period
    return Symptom(within(
        effect_class('nonstationary_excitation'), depth=depth, period_s=period,
        phase_rad=float(np.angle(np.exp(1j * phase)))), p,
                   f'the level swings by {100 * depth:.0f} % every {period:.0f} s',
                   {'depth': depth / size, 'period_s': np.sqrt(6) / np.pi / size * period ** 2
                    * torque.rate_hz / count, 'phase_rad': 2 / size},
                   look=(float(gains[best]), cells))


def wander(torque, period_s):
    """
    Return how much of a sinusoid of a period, and of its neighbours, the level has by chance.

    A hinge that rattles follows the slow modes, and so does the level: it wanders.

    Returns
    -------
    ndarray, shape (3,)
        1 in the mean where the level is steady; as the gain that `swing` looks for.

    """
    level = _magnitude(torque)
    coarse, at, block = _coarse(level, torque.rate_hz)
    step, spread = torque.rate_hz / len(level), np.var(level) / block
    near = np.maximum(1 / period_s + step * np.arange(-1, 2), SLOWEST * step)
    gains = np.array([_sine_fit(coarse, at, f)[0] for f in near]) / (2 * spread)
    return gains / _by_chance(coarse, at, spread, 1 / period_s)(near)


def _by_chance(coarse, at, spread, line_hz):
    """
    Return the mean gain of a sinusoid by chance, at least 1, as a function of frequency, (109b).

    Noise that motion makes has the level of the motion, and that of a mode wanders as slowly as
    it rings; pulses raise the mean at all frequencies.
    """
    rows, span = len(coarse), len(coarse) * (at[1] - at[0])
    line_hz, left = _strongest(coarse, at, line_hz - 0.25 / span, line_hz + 0.25 / span), coarse
    # a swing is no chance, nor is its harmonic, which the noise that does not swing makes of it
    for frequency in (line_hz, 2 * line_hz):
        turns = 2 * np.pi * frequency * at
        _, (cosine, sine), _ = _sine_fit(left, at, frequency)
        left = left - cosine * np.cos(turns) - sine * np.sin(turns)
    cells = (np.abs(np.fft.rfft(left - left.mean())) ** 2 / (rows * spread))[1:]
    frequencies = np.arange(1, len(cells) + 1) / span
    cells, frequencies = cells[frequencies <= FASTEST_HZ], frequencies[frequencies <= FASTEST_HZ]
    corners = np.geomspace(min(WIDE / span, FASTEST_HZ / 2), FASTEST_HZ / 2, CORNERS)
    shapes = 1 + RATIOS[:, None, None] / (1 + (frequencies / corners[:, None]) ** 2)
    mean = max(1.0, np.median(cells) / np.log(2))
    for _ in range(3):
        seen = np.minimum(cells, LINE * mean)
        floors = np.maximum(1.0, (seen / shapes).mean(axis=-1))
        means = floors[..., None] * shapes
        logs = -(np.log(means) + seen / means).sum(axis=-1)
        best = np.unravel_index(np.argmax(logs), logs.shape)
        if logs[best] < logs[0, 0] + LIKELIER:
            best = (0, 0)
        mean = means[best]
    return lambda f: floors[best] * (1 + RATIOS[best[0]] / (1 + (f / corners[best[1]]) ** 2))


def _coarse(level, rate_hz):
    """Return means of a level, their times [s], and of how many samples each is."""
    block = max(1, int(rate_hz / 8))            # means over an eighth of a second are enough
    rows = len(level) // block
    return (level[:rows * block].reshape(-1, block).mean(axis=1),
            (np.arange(rows) + 0.5) * block / rate_hz, block)


def level_of(unit, period):
    """Return the sinusoidal level of a series about 1, of a period in samples."""
    turn = np.exp(2j * np.pi * np.arange(len(unit)) / period)
    columns = np.column_stack([np.ones(len(unit)), turn.real, turn.imag])
    # mean magnitudes follow the level and mind pulses less than squares do
    found, *_ = np.linalg.lstsq(columns, np.abs(unit), rcond=None)
    return np.maximum(columns @ found / found[0], 0.2)


def _magnitude(torque, level=1.0):
    """
    Return the mean magnitude over time of all that drives, about 1; 1 where rows are missing.

    It follows a level in a straight line, and minds pulses less than power does.
    """
    there = ~torque.missing[torque.inside]
    total = np.zeros(len(there))
    for values in torque.white.T:
        unit = np.abs(torque.series(values=values)[torque.inside]) / level
        unit = np.minimum(unit, MAGNITUDE * np.median(unit)) * level
        total += unit / unit[there].mean() / torque.white.shape[1]
    return np.where(there, total, 1.0)


def _undiluted(seen, excited):
    """Return the depth of a level, of which the share of power that it scales shows `seen`."""
    depths = np.linspace(0.0, 1.0, 101)
    sine = np.sin(2 * np.pi * (np.arange(64) + 0.5) / 64)
    magnitude = np.sqrt(1 - excited + excited * (1 + depths[:, None] * sine) ** 2)
    return float(np.interp(seen, 2 * (magnitude @ sine) / magnitude.sum(axis=1), depths))


def _strongest(coarse, at, low_hz, high_hz):
    """Return the frequency between two at which a sinusoid explains most."""
    return minimize_scalar(lambda f: -_sine_fit(coarse, at, f)[0], bounds=(low_hz, high_hz)).x


def _swing_of(values, at, frequency):
    """Return cosine and sine of a level over what it swings about."""
    _, found, middle = _sine_fit(values, at, frequency)
    return found / max(middle, 0.2 * values.mean())


def _sine_fit(values, at, frequency):
    """
    Return the sum of squares that a sinusoid explains, its cosine and sine, and their middle.

    The mean of one period and a half is not what a level swings about.
    """
    columns = np.column_stack([np.cos(2 * np.pi * frequency * at),
                               np.sin(2 * np.pi * frequency * at), np.ones(len(at))])
    means = columns[:, :2].mean(axis=0)
    centred = columns[:, :2] - means
    found, *_ = np.linalg.lstsq(centred, values - values.mean(), rcond=None)
    return np.sum((centred @ found) ** 2), found, values.mean() - means @ found
