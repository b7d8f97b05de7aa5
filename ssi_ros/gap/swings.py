"""Search what drives a record for a swing of its level: a sine in its magnitude, eq. (109)."""
import numpy as np
from scipy.optimize import minimize_scalar

from ssi_ros.effects import effect_class
from ssi_ros.gap.symptoms import chance, SURE, Symptom, within

SLOWEST = 0.7           # periods of the level that a record must hold
MAGNITUDE = 4.5         # medians of the magnitude (3 sd) at which a sample is cut for the level
FASTEST_HZ = 1.0        # of a swing of the level that is looked for


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
    # pulses ring in what drives, and raise the mean of it at all frequencies
    gains /= max(1.0, np.median(gains[gains > 0]) / np.log(2))
    best = int(np.argmax(gains))
    cells = 4 * FASTEST_HZ * count / torque.rate_hz
    p = chance(gains[best], cells)
    if p > SURE:
        return None
    frequency = minimize_scalar(lambda f: -_sine_fit(coarse, at, f)[0], bounds=(
        frequencies[best - 1], frequencies[best + 1])).x
    _, (cosine, sine) = _sine_fit(coarse, at, frequency)
    size = np.sqrt(2 * gains[best])
    period = 1 / frequency
    # once more, so that crests are not cut for being crests
    turns = 2 * np.pi * np.arange(count) / torque.rate_hz / period
    level = _magnitude(torque, 1 + min(1, 0.95 / np.hypot(cosine, sine)) * (
        cosine * np.cos(turns) + sine * np.sin(turns)))
    _, (cosine, sine) = _sine_fit(_coarse(level, torque.rate_hz)[0], at, frequency)
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
    step = torque.rate_hz / len(level)
    near = [max(1 / period_s + n * step, SLOWEST * step) for n in (-1, 0, 1)]
    return np.array([_sine_fit(coarse, at, f)[0] for f in near]) * block / (2 * np.var(level))


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


def _sine_fit(values, at, frequency):
    """Return the sum of squares that a sinusoid explains, and its cosine and sine."""
    columns = np.column_stack([np.cos(2 * np.pi * frequency * at),
                               np.sin(2 * np.pi * frequency * at), np.ones(len(at))])
    centred = columns[:, :2] - columns[:, :2].mean(axis=0)
    found, *_ = np.linalg.lstsq(centred, values - values.mean(), rcond=None)
    return np.sum((centred @ found) ** 2), found
