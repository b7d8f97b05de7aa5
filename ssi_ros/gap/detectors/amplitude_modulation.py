"""Amplitude modulation: a sine in the magnitude of what drives a record, eq. (109)."""
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ssi_ros.effects.registry import deflection, detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors.thresholds import LIMITS
from ssi_ros.scipy_later import minimize_scalar
from ssi_ros.tails import tail_of_highest

MAGNITUDE = 4.5         # medians of the magnitude (3 sd) at which a sample is cut for the level
BLOCKS_HZ = 8.0         # means over an eighth of a second are enough
PADDED = 8              # times finer grid of frequencies
FEW = 4                 # periods of a record, below which sine and mean are not orthogonal
# Of a level that varies by chance: so many cells wide at least, or a slow modulation would pass
# for it; corners of its spectrum, and powers below them over those above.
WIDE, CORNERS, RATIOS = 12, 8, np.append(0.0, np.geomspace(0.5, 64.0, 15))
LINE = 6.0              # means above which a cell is a line, apart from the rest


@dataclass(frozen=True, eq=False)
class Modulation(Detection):
    """A detection of a modulation, with the gain of its log likelihood over that by chance."""

    gain: float = 0.0


@detects('nonstationary_excitation', of='input')
def detect_modulation(effect, reconstruction):
    """Detect the strongest sinusoidal modulation of all that excites, eq. (109)."""
    found = strongest_modulation(reconstruction)
    if found is None:
        return None
    within = effect.within(**found.parameters)
    return replace(found, effect=effect.name, parameters=within.values(), basis=within)


@deflection('nonstationary_excitation')
def modulation_deflection(effect, sensitivity):
    """Return d' of a modulation."""
    return effect.depth * np.sqrt(sensitivity.rows * sensitivity.channels)


@lru_cache(maxsize=1)
def strongest_modulation(reconstruction):
    """Return the strongest modulation, 1 + depth sin(2 pi t / period_s + phase_rad), or None."""
    # The detectors of modulation and of impulses both ask for it; it is of no effect yet.
    level = _magnitude(reconstruction)
    rate_hz, count = reconstruction.rate_hz, len(level)
    coarse, at, block = _coarse(level, rate_hz)
    rows = len(coarse)
    spread = np.var(level) / block
    size = PADDED * rows
    step_hz = rate_hz / block / size
    fastest_hz = LIMITS.fastest_hz.value
    gains = np.abs(np.fft.rfft(coarse - coarse.mean(), size)) ** 2 / (rows * spread)
    frequencies = np.arange(len(gains)) * step_hz
    low = int(np.ceil(LIMITS.least_periods.value * rate_hz / count / step_hz))
    few = int(FEW / step_hz * rate_hz / count)
    gains[low:few] = [_sine_fit(coarse, at, f)[0] / (2 * spread) for f in frequencies[low:few]]
    gains[:low], gains[frequencies > fastest_hz] = 0.0, 0.0
    cells = 4 * fastest_hz * count / rate_hz
    if tail_of_highest(gains.max(), cells) > LIMITS.p_value.value:
        return None             # by chance they are at least 1
    gains /= _by_chance(coarse, at, spread, frequencies[np.argmax(gains)])(frequencies)
    best = int(np.argmax(gains))
    p_value = tail_of_highest(gains[best], cells)
    if p_value > LIMITS.p_value.value:
        return None
    # a gap has no level of its own
    there = _coarse(~reconstruction.missing[reconstruction.inside], rate_hz)[0] == 1.0
    at = at[there]
    frequency = _strongest(coarse[there], at, frequencies[best - 1],
                           frequencies[min(best + 1, len(gains) - 1)])
    cosine, sine = _modulation_at(coarse[there], at, frequency)
    # once more, so that crests are not cut for being crests
    turns = 2 * np.pi * np.arange(count) / rate_hz * frequency
    level = _magnitude(reconstruction, 1 + min(1, 0.95 / np.hypot(cosine, sine)) * (
        cosine * np.cos(turns) + sine * np.sin(turns)))
    cosine, sine = _modulation_at(_coarse(level, rate_hz)[0][there], at, frequency)
    depth = _undiluted(np.hypot(cosine, sine), reconstruction.excited)
    phase = np.arctan2(cosine, sine) - (
        2 * np.pi * reconstruction.inside.start / rate_hz * frequency)
    size = np.sqrt(2 * gains[best])
    stds = {'depth': depth / size, 'phase_rad': 2 / size, 'period_s':
            np.sqrt(6) / np.pi / size / frequency ** 2 * rate_hz / count}
    return Modulation(
        '', {'depth': depth, 'period_s': 1 / frequency,
             'phase_rad': float(np.angle(np.exp(1j * phase)))}, p_value,
        f'The level is modulated by {100 * depth:.0f} % with a period of {1 / frequency:.0f} s.',
        stds, round(cells), gain=float(gains[best]))


def modulation_by_chance(reconstruction, period_s):
    """
    Return the gains (3,) of sinusoids of a period and its neighbours that a level has by chance.

    They are those of a `Modulation`, 1 in the mean where the level is steady. The noise of a hinge
    with play follows the slow modes, and so does the level.
    """
    level = _magnitude(reconstruction)
    coarse, at, block = _coarse(level, reconstruction.rate_hz)
    step, spread = reconstruction.rate_hz / len(level), np.var(level) / block
    near = np.maximum(1 / period_s + step * np.arange(-1, 2), LIMITS.least_periods.value * step)
    gains = np.array([_sine_fit(coarse, at, f)[0] for f in near]) / (2 * spread)
    return gains / _by_chance(coarse, at, spread, 1 / period_s)(near)


def _by_chance(coarse, at, spread, line_hz):
    """
    Return the mean gain of a sinusoid by chance, at least 1, as a function of frequency, (109b).

    Noise that motion makes has the level of the motion, and that of a mode varies as slowly as its
    response decays; impulses raise the mean at all frequencies.
    """
    rows, span = len(coarse), len(coarse) * (at[1] - at[0])
    line_hz, rest = _strongest(coarse, at, line_hz - 0.25 / span, line_hz + 0.25 / span), coarse
    # a modulation is no chance, nor its harmonic, which noise of steady level makes of it
    for frequency in (line_hz, 2 * line_hz):
        turns = 2 * np.pi * frequency * at
        _, (cosine, sine), _ = _sine_fit(rest, at, frequency)
        rest = rest - cosine * np.cos(turns) - sine * np.sin(turns)
    cells = (np.abs(np.fft.rfft(rest - rest.mean())) ** 2 / (rows * spread))[1:]
    frequencies = np.arange(1, len(cells) + 1) / span
    fastest_hz = LIMITS.fastest_hz.value
    cells, frequencies = cells[frequencies <= fastest_hz], frequencies[frequencies <= fastest_hz]
    corners = np.geomspace(min(WIDE / span, fastest_hz / 2), fastest_hz / 2, CORNERS)
    shapes = 1 + RATIOS[:, None, None] / (1 + (frequencies / corners[:, None]) ** 2)
    mean = max(1.0, np.median(cells) / np.log(2))
    for _ in range(3):
        cut = np.minimum(cells, LINE * mean)
        floors = np.maximum(1.0, (cut / shapes).mean(axis=-1))
        means = floors[..., None] * shapes
        logs = -(np.log(means) + cut / means).sum(axis=-1)
        best = np.unravel_index(np.argmax(logs), logs.shape)
        if logs[best] < logs[0, 0] + LIMITS.likelier.value:
            best = (0, 0)
        mean = means[best]
    return lambda f: floors[best] * (1 + RATIOS[best[0]] / (1 + (f / corners[best[1]]) ** 2))


def _coarse(level, rate_hz):
    """Return means of a level, their times [s], and of how many samples each is."""
    block = max(1, int(rate_hz / BLOCKS_HZ))
    rows = len(level) // block
    return (level[:rows * block].reshape(-1, block).mean(axis=1),
            (np.arange(rows) + 0.5) * block / rate_hz, block)


def level_of(unit, period):
    """Return the sinusoidal level of a series about 1, of a period in samples."""
    turn = np.exp(2j * np.pi * np.arange(len(unit)) / period)
    columns = np.column_stack([np.ones(len(unit)), turn.real, turn.imag])
    # mean magnitudes follow the level, and impulses change them less than squares
    found, *_ = np.linalg.lstsq(columns, np.abs(unit), rcond=None)
    return np.maximum(columns @ found / found[0], 0.2)


def _magnitude(reconstruction, level=1.0):
    """
    Return the mean magnitude over time of all that drives, about 1; 1 where rows are missing.

    It is proportional to the level, and impulses change it less than they do power.
    """
    there = ~reconstruction.missing[reconstruction.inside]
    total = np.zeros(len(there))
    for values in reconstruction.white.T:
        unit = np.abs(reconstruction.series(values=values)[reconstruction.inside]) / level
        unit = np.minimum(unit, MAGNITUDE * np.median(unit)) * level
        total += unit / unit[there].mean() / reconstruction.white.shape[1]
    return np.where(there, total, 1.0)


def _undiluted(observed, excited):
    """Return the depth of a level that scales the share `excited` of the power observed."""
    depths = np.linspace(0.0, 1.0, 101)
    sine = np.sin(2 * np.pi * (np.arange(64) + 0.5) / 64)
    magnitude = np.sqrt(1 - excited + excited * (1 + depths[:, None] * sine) ** 2)
    return float(np.interp(observed, 2 * (magnitude @ sine) / magnitude.sum(axis=1), depths))


def _strongest(coarse, at, low_hz, high_hz):
    """Return the frequency between two at which a sinusoid explains most."""
    return minimize_scalar(lambda f: -_sine_fit(coarse, at, f)[0], bounds=(low_hz, high_hz)).x


def _modulation_at(values, at, frequency):
    """Return cosine and sine of a level over its middle."""
    _, found, middle = _sine_fit(values, at, frequency)
    return found / max(middle, 0.2 * values.mean())


def _sine_fit(values, at, frequency):
    """
    Return the sum of squares that a sinusoid explains, its cosine and sine, and their middle.

    The mean of one period and a half is not what a level is modulated about.
    """
    columns = np.column_stack([np.cos(2 * np.pi * frequency * at),
                               np.sin(2 * np.pi * frequency * at), np.ones(len(at))])
    means = columns[:, :2].mean(axis=0)
    centred = columns[:, :2] - means
    found, *_ = np.linalg.lstsq(centred, values - values.mean(), rcond=None)
    return np.sum((centred @ found) ** 2), found, values.mean() - means @ found
