"""
Does a mode change with its own amplitude? Inside one recording, eq. (154) to (157).

The statistics are zero for every linear structure, whatever its spectrum, as long as the motion is
Gaussian. Their scatter comes from surrogates with the same spectrum and random phases, which keep
the lines of a periodic excitation, and from blocks of the recording; the larger counts.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.tails import student

SURROGATES = 40
BLOCKS = 20
MOST_ROWS = 2 ** 18     # values of the recording that bursts are sought in
HALF_BAND = 6.0         # half-widths of a mode that its filter passes
CLIP = 1.5              # of the logarithm of the amplitude over its rms
OFTEN = 0.95            # quantile of the power that bursts are clipped at
LINES = 4.0             # of a periodic excitation, that make the amplitude of a mode vary
HARMONIC = 2.5          # bursts are sought above so many times the frequency of the mode


@dataclass(frozen=True, eq=False)
class Dependence:
    """
    How the modes of a recording depend on their amplitude, each of shape (m,), with deviations.

    Slopes are the relative change of the frequency where the amplitude grows e-fold; bursts say
    how much the power above the mode follows its phase.
    """

    frequency_slopes: np.ndarray
    frequency_stds: np.ndarray
    bursts: np.ndarray
    burst_stds: np.ndarray

    def beside(self, reference, lines):
        """Return this with the slopes that it has beyond those of the reference, eq. (154a)."""
        # of one line (m,) of an excitation alone within the width of a mode its amplitude hardly
        # changes
        few = np.where(lines < LINES, np.inf, 1.0)
        return replace(
            self, frequency_slopes=self.frequency_slopes - reference.frequency_slopes,
            frequency_stds=few * np.hypot(self.frequency_stds, reference.frequency_stds))


def amplitude_dependence(values, rate_hz, modes, seed=0):
    """Measure how every mode of a recording (n, l) depends on its amplitude, a `Dependence`."""
    rng = np.random.default_rng(seed)
    rows = min(len(values), max(MOST_ROWS // values.shape[1], 4096))
    spectrum = np.fft.rfft(values[:rows], axis=0)
    table = []
    for i, f0 in enumerate(modes.frequencies_hz):
        z, rate = _narrow(spectrum @ modes.duals[:, i].conj(), rows, rate_hz, f0,
                          modes.damping_ratios[i])
        slope = _slopes(z[None])[0]
        chance = np.std(_slopes(_shuffled(z, rng)), axis=0)
        blocks = _slopes(_blocks(z))
        spread = np.maximum(chance, np.std(blocks, axis=0) / np.sqrt(len(blocks)))
        unit = rate / (2 * np.pi * f0)
        table.append((slope * unit, spread * unit))
    columns = np.array(table).reshape(-1, 2).T
    bursts, stds = _bursts(spectrum, rows, rate_hz, modes, rng)
    return Dependence(*columns, bursts, stds)


def significance(values, stds):
    """Return two-sided p-values of slopes, whose spread comes from finitely many surrogates."""
    return 2 * student.sf(np.abs(values) / np.maximum(stds, 1e-300), BLOCKS - 1)


def _narrow(spectrum, rows, rate_hz, f0, xi):
    """Return the slow complex amplitude of a mode and its rate, from its own bins alone."""
    half = max(int(np.ceil(HALF_BAND * xi * f0 * rows / rate_hz)), 8)
    centre = round(f0 * rows / rate_hz)
    bins = np.arange(centre - half, centre + half + 1)
    kept = np.zeros(len(bins), complex)
    inside = (bins > 0) & (bins < len(spectrum))
    kept[inside] = spectrum[bins[inside]]
    kept *= np.hanning(len(kept) + 2)[1:-1]
    return np.fft.ifft(np.fft.ifftshift(kept)), len(kept) * rate_hz / rows


def _shuffled(z, rng):
    bins = np.fft.fft(z)
    return np.fft.ifft(bins * np.exp(2j * np.pi * rng.random((SURROGATES, len(z)))), axis=1)


def _blocks(z):
    size = max(len(z) // BLOCKS, 4)
    return z[:len(z) // size * size].reshape(-1, size)


def _slopes(z):
    """Fit z(k+1) = (a + b q) z(k), q = log |z(k)| over rms: Im b / a of each row, (s,), (154)."""
    now, then = z[:, :-1], z[:, 1:]
    power = np.abs(now) ** 2
    q = np.log(np.maximum(power, 1e-300) / power.mean()) / 2
    q = np.clip(q, -CLIP, CLIP)
    # weights 1 / amplitude: few large amplitudes shall not decide
    w = 1 / np.sqrt(np.maximum(power, 1e-300))
    m0, m1, m2 = (np.sum(w * power * q ** k, axis=1) for k in range(3))
    c0, c1 = (np.sum(w * then * now.conj() * q ** k, axis=1) for k in range(2))
    # b / a of the two normal equations; a row that is zero says nothing
    b, a = m0 * c1 - m1 * c0, m2 * c0 - m1 * c1
    return np.divide(b, a, out=np.zeros_like(b), where=a != 0).imag


def _bursts(spectrum, rows, rate_hz, modes, rng):
    """Correlate the power above a mode with its phase and with twice its phase, eq. (156)."""
    frequencies = np.arange(len(spectrum)) * rate_hz / rows
    smooth = max(len(spectrum) // 400, 3)
    power = np.apply_along_axis(np.convolve, 0, np.abs(spectrum) ** 2, np.ones(smooth), 'same')
    flat = spectrum / np.sqrt(np.maximum(power, 1e-300))
    found, chance = [], []
    for i, f0 in enumerate(modes.frequencies_hz):
        high = HARMONIC * f0
        if high > 0.7 * frequencies[-1]:
            found.append(0.0), chance.append(1.0)
            continue
        half = max(HALF_BAND * modes.damping_ratios[i] * f0, 4 * rate_hz / rows)
        own = np.where(np.abs(frequencies - f0) < half, spectrum @ modes.duals[:, i].conj(), 0)
        above = flat * (frequencies > high)[:, None]
        found.append(_locked(own, above, rows))
        shuffled = [_locked(own, above * np.exp(2j * np.pi * rng.random((len(own), 1))), rows)
                    for _ in range(8)]
        chance.append(np.sqrt(np.mean(np.square(shuffled))))
    return np.array(found), np.array(chance)


def _locked(own, above, rows):
    signal = np.zeros(rows, complex)
    signal[:len(own)] = own
    phase = np.exp(1j * np.angle(np.fft.ifft(signal)))
    power = np.sum(np.fft.irfft(above, rows, axis=0) ** 2, axis=1)
    # a joint impacts in every cycle; a few impulses from outside are at some phase, too
    power = np.minimum(power, np.quantile(power, OFTEN))
    power = power / power.mean() - 1
    return float(np.hypot(np.abs(np.mean(power * phase)), np.abs(np.mean(power * phase ** 2))))
