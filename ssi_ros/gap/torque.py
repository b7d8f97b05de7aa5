"""
The torque that would explain a record, and what stands out of it: lines, sweeps, pulses, swings.

One torque drives all channels, so h^H S^-1 Y is all that the record says of it. Over its standard
deviation it is white where the model is right, and a disturbance of the torque keeps its phase in
it, eq. (106) to (110): the whole record is searched coherently.
"""
from dataclasses import dataclass

import numpy as np
from scipy.stats import gamma, norm

from ssi_ros.effects import effect_class
from ssi_ros.gap.spectra import spectra, whole_frame
from ssi_ros.gap.sweeps import sweep
from ssi_ros.gap.swings import level_of, swing
from ssi_ros.gap.symptoms import chance, moments, Oddity, SURE, Symptom, within

EDGE_S = 1.0            # on which the taper rises and falls at the ends of the record
RINGS_S = 6.0           # left out at both ends, where the taper disturbs what filters recall
LEAST_PEAK = 3.3        # standard deviations of a peak that counts
MOST_PEAKS = 1500
RING = 3000             # samples after which the ring of a pulse is over


@dataclass(frozen=True, eq=False)
class Torque:
    """
    What a record says of the torque.

    Attributes
    ----------
    rate_hz : float
        Rate [Hz].
    rows : int
        Samples of the record.
    first : int
        Bin of the first value below.
    values : ndarray, shape (k,)
        Whitened spectrum, E|u|^2 = 1.
    gain : ndarray, shape (k,)
        What a torque spectrum of 1 adds to it, sqrt(h^H S^-1 h).
    taper : ndarray, shape (rows,)
        Weights of the samples, of sum of squares 1.
    beside : ndarray, shape (k, l)
        What no torque explains, seen as a disturbance of each channel: P Y over the root of its
        diagonal, P = S^-1 - S^-1 h h^H S^-1 / h^H S^-1 h.
    beside_gain : ndarray, shape (k, l)
        What a disturbance of 1 on a channel adds to it.
    power : ndarray, shape (k,)
        Y^H P Y, of l - 1 degrees of freedom.
    white : ndarray, shape (k, l)
        All channels whitened, C^H Y with C C^H = S^-1: what drives them, whatever it is.
    excited : float
        Share of the power of `white` that the excitation makes; the rest is noise.
    missing : ndarray of bool, shape (rows,)
        Rows that are not there, with their neighbours: a hole is neither pulse nor calm.

    """

    rate_hz: float
    rows: int
    first: int
    values: np.ndarray
    gain: np.ndarray
    taper: np.ndarray
    beside: np.ndarray
    beside_gain: np.ndarray
    power: np.ndarray
    white: np.ndarray
    excited: float
    missing: np.ndarray

    def tapered(self, values):
        """Return the tapered time series of such a spectrum, shape (rows,)."""
        full = np.zeros(self.rows // 2 + 1, complex)
        full[self.first:self.first + len(values)] = values
        return np.fft.irfft(full, self.rows)

    def series(self, weight=1.0, values=None):
        """Return the time series of weighted values, of unit variance, shape (rows,)."""
        weight = np.broadcast_to(weight, self.values.shape)
        values = self.values if values is None else values
        return self.tapered(values * weight) * (
            self.rows / np.sqrt(2 * np.sum(weight ** 2)) / (self.taper * np.sqrt(self.rows)))

    @property
    def inside(self):
        """Slice of the samples that the taper does not disturb."""
        edge = int(min(RINGS_S * self.rate_hz, self.rows / 8))
        return slice(edge, self.rows - edge)


def reconstruct(simulator, fitted, samples, settings):
    """
    Reconstruct the torque of a record.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    fitted : Fit
        The model that holds but for the torque.
    samples : Samples
        The record.
    settings : DiagnosisSettings
        Band.

    Returns
    -------
    Torque

    """
    missing = np.isnan(samples.values).any(axis=1)
    # a clock that is wrong in the model as well: frequencies are those of the true time
    setup = simulator.setup(fitted.candidate, fitted.levels)
    rate_hz = setup.system.rate_hz
    frame = whole_frame(len(samples.values), rate_hz, settings, EDGE_S, ~missing)
    row, gain, inverse, excited = torque_filter(
        simulator, setup, fitted.levels, frame)
    spectrum = spectra(samples, frame)[0]
    values = np.einsum('kj,kj->k', row, spectrum) / gain
    rest = np.einsum('kij,kj->ki', inverse, spectrum) - (
        row.conj() * (values / gain)[:, None])
    own = np.sqrt(np.maximum(np.einsum('kii->ki', inverse).real
                             - np.abs(row) ** 2 / gain[:, None] ** 2, 1e-300))
    power = np.einsum('ki,ki->k', spectrum.conj(), rest).real
    white = np.einsum('kji,kj->ki', np.linalg.cholesky(inverse).conj(), spectrum)
    return Torque(rate_hz, frame.rows, frame.first, values, gain, frame.taper, rest / own,
                  own, power, white, excited,
                  np.convolve(missing, np.ones(3), mode='same') > 0)


def torque_filter(simulator, setup, levels, frame):
    """
    Return h^H S^-1, sqrt(h^H S^-1 h) and S^-1 for every bin of a frame of one piece.

    And the share of the whitened power that the excitation makes.

    Returns
    -------
    row : ndarray, shape (k, l)
    gain : ndarray, shape (k,)
    inverse : ndarray, shape (k, l, l)
    excited : float

    """
    spectrum = simulator.on(frame).spectrum(setup)
    inverse = np.linalg.inv(spectrum.at(levels)[0])
    driven = sum(level * share[0] for level, share in zip(levels, spectrum.shares[:-1]))
    excited = np.einsum('kij,kji->', inverse, driven).real / inverse[..., 0].size
    system = setup.system
    h = system.transfer(frame.frequencies_hz, system.rate_hz)[
        :, :, system.inputs.index('torque_x')]
    row = np.einsum('ki,kij->kj', h.conj(), inverse)
    return row, np.sqrt(np.einsum('kj,kj->k', row, h).real), inverse, float(excited)


def torque_signs(torque, names):
    """Return the signs of disturbances that a torque shows, of the effects named."""
    swings = None
    if {'impulsive_events', 'nonstationary_excitation'} & set(names):
        swings = swing(torque)
    tests = {'harmonic_disturbance': lambda: line(torque),
             'impulsive_events': lambda: pulses(torque, swings),
             'nonstationary_excitation': lambda: swings,
             'wheel_speed_sweep': lambda: sweep(torque)}
    found = [test() for name, test in tests.items() if name in names]
    return tuple(s for s in found if s is not None)


def odd_signs(torque, channels):
    """
    Return signs that no effect of the library makes: lines and spikes that are not of the torque.

    Parameters
    ----------
    torque : Torque
        Of a record without missing rows.
    channels : sequence of str
        Their names.

    Returns
    -------
    tuple of Oddity

    """
    if len(channels) < 2:
        return ()
    found = []
    chances = gamma.sf(torque.power, len(channels) - 1)
    best = int(np.argmin(chances))
    p = float(min(1.0, 1.5 * len(chances) * chances[best]))
    if p < SURE:
        at = (torque.first + best) * torque.rate_hz / torque.rows
        found.append(Oddity('a line beside the torque', p,
                            f'a line at {at:.5g} Hz that no torque makes'))
    for i, channel in enumerate(channels):
        gain = torque.beside_gain[:, i]
        unit = torque.series(gain, torque.beside[:, i])[torque.inside]
        p, height, count, *_ = _pulse_likelihood(torque, unit, gain)
        if p * len(channels) < SURE:
            # whatever the channel: a candidate whose records have spikes may have them anywhere
            found.append(Oddity('spikes', float(p * len(channels)),
                                f'about {count[0]:.0f} spikes on {channel} of {height[0]:.1f} sd'))
    return tuple(found)


def line(torque):
    """
    Find the strongest sine, eq. (106).

    Returns
    -------
    Symptom or None

    """
    series = np.concatenate([torque.tapered(torque.values), np.zeros(torque.rows)])
    last = torque.first + len(torque.values)
    # twice as many bins: a sine between two of them keeps 90 % of its power
    fine = np.fft.rfft(series)[2 * torque.first:2 * last - 1]
    power = np.abs(fine) ** 2
    # a strong line has raised the levels that the torque was taken at
    scale = np.median(power[::2]) / np.log(2)
    power /= scale
    best = int(np.argmax(power))
    p = chance(power[best], 1.5 * len(torque.values))
    if p > SURE:
        return None
    frequency = _refine(power, best) / 2 + torque.first
    gain = np.interp(frequency, np.arange(torque.first, last), torque.gain)
    height = np.sqrt(scale * max(_top(power, best) - 1.0, 0.0))
    amplitude = 2 * height / gain / np.sum(torque.taper)
    frequency_hz = frequency * torque.rate_hz / torque.rows
    size = np.sqrt(2 * power[best])
    std = {'torque_n_m': amplitude / size,
           'frequency_hz': np.sqrt(6) / np.pi / size * torque.rate_hz / torque.rows}
    return Symptom(within(
        effect_class('harmonic_disturbance'), frequency_hz=frequency_hz, torque_n_m=amplitude), p,
        f'a line at {frequency_hz:.5g} Hz, {size:.1f} sd', std)


def pulses(torque, swings=None):
    """
    Find pulses that are one sample long, eq. (108).

    The matched filter of a pulse has unit variance and a known ring. Its peaks, the ring of larger
    ones taken out, are Rice's for Gaussian noise; pulses add a Poisson number of one height.

    Parameters
    ----------
    torque : Torque
        Of the record.
    swings : Symptom, optional
        A swing of the level, which is taken out first: its crests are no pulses.

    Returns
    -------
    Symptom or None

    """
    unit = np.where(torque.missing, 0.0, torque.series(torque.gain))[torque.inside]
    if swings is not None:
        unit = unit / level_of(unit, swings.effect.period_s * torque.rate_hz)
    p, (height, height_std), (count, count_std), quiet, (rows, sure) = _pulse_likelihood(
        torque, unit, torque.gain)
    if p > SURE:
        return None
    through = np.sqrt(2 * np.sum(torque.gain ** 2)) * torque.taper.max()
    impulse = quiet / through / torque.rate_hz
    per_min = 60 / (len(unit) / torque.rate_hz)
    return Symptom(within(
        effect_class('impulsive_events'), rate_per_min=per_min * count,
        impulse_n_m_s=impulse * height), p,
        f'about {count:.0f} pulses of {impulse * height:.3g} N m s',
        {'rate_per_min': per_min * max(count_std, np.sqrt(count)),
         'impulse_n_m_s': impulse * max(height_std, 1 / np.sqrt(count))},
        ((torque.inside.start + rows) / torque.rate_hz, sure))


def _pulse_likelihood(torque, unit, gain):
    """
    Return p-value, height and count with their spreads, and the scale of the quiet series.

    And the places of all peaks, with the chance of each to be a pulse.
    """
    spectrum = np.zeros(torque.rows // 2 + 1)
    spectrum[torque.first:torque.first + len(gain)] = gain ** 2
    ring = np.fft.irfft(spectrum, torque.rows)
    # the pulses themselves have raised the levels that the unit was taken from
    quiet = float(np.sqrt(np.mean(np.minimum(unit ** 2, 9.0)) / 0.97))
    places, heights = _peaks(unit / quiet, ring / ring[0])
    turns = 2 * np.pi * np.arange(len(spectrum)) / torque.rows
    speed = np.sqrt(np.sum(turns ** 2 * spectrum) / np.sum(spectrum))
    usual = len(unit) * speed / np.pi               # times exp(-a^2 / 2): peaks above a
    sizes = np.linspace(0.5 * LEAST_PEAK, 1.1 * max(heights, default=LEAST_PEAK), 60)
    counts = np.geomspace(0.5, 1e4, 80)
    values = np.empty((len(sizes), len(counts)))
    noise = usual * heights * np.exp(-np.minimum(heights ** 2 / 2, 600.0))
    for row, height in zip(values, sizes):
        density = norm.pdf(heights - height) / noise
        row[:] = (np.log1p(counts[:, None] * density).sum(axis=1)
                  - counts * norm.sf(LEAST_PEAK - height))
    p = float(min(1.0, 4 * np.exp(-values.max())))
    # few pulses of one height and more of a smaller one look alike: means over all that fit
    weights = np.exp(values - values.max())
    size, count = (moments(sizes, weights.sum(axis=1)), moments(counts, weights.sum(axis=0)))
    there = count[0] * norm.pdf(heights, size[0], np.hypot(1.0, size[1]))
    return p, size, count, quiet, (places, there / (there + noise))


def _peaks(unit, ring):
    """Return places and heights of peaks above LEAST_PEAK, each with its ring taken out."""
    unit, places, heights = unit.copy(), [], []
    half = min(len(unit), RING)
    both = np.concatenate([ring[half - 1:0:-1], ring[:half]])
    while len(heights) < MOST_PEAKS:
        at = int(np.argmax(np.abs(unit)))
        height = unit[at]
        if abs(height) < LEAST_PEAK:
            break
        places.append(at)
        heights.append(abs(height))
        low, high = max(0, at - half + 1), min(len(unit), at + half)
        unit[low:high] -= height * both[low - at + half - 1:high - at + half - 1]
    return np.array(places, int), np.array(heights)


def _refine(power, best):
    """Return the place of a maximum between bins, by a parabola through the logarithms."""
    if not 0 < best < len(power) - 1:
        return float(best)
    a, b, c = np.log(power[best - 1:best + 2])
    return best + 0.5 * (a - c) / (a - 2 * b + c)


def _top(power, best):
    """Return the height of that parabola."""
    if not 0 < best < len(power) - 1:
        return float(power[best])
    a, b, c = np.log(power[best - 1:best + 2])
    return float(np.exp(b - 0.125 * (a - c) ** 2 / (a - 2 * b + c)))
