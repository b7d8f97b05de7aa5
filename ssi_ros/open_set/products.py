"""
Products of adjoint and motion: the score of a number that varies, in time and in frequency.

The score of a number at time t is a product of two Gaussian series, whose covariances the model
knows. What varies as phi(t) has the score sum_t s(t) phi(t), of variance sum_a V(a) |Phi(a)|^2.
"""
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import fft, ifft, irfft, next_fast_len, rfft

from ssi_ros.tails import chi2, norm
from ssi_ros.windows import excess_around

LEAST = 1e-4            # variance of a part over that of the whole product: rounding
FREEDOM = 0.5           # independent values of a motion in one decay of its amplitude
NEARLY, MOST_NAMED = 0.6, 2      # strength over the largest that is named beside it
NEAR = 65               # offsets that show the scatter of one
SLOW = 8                # cosines that a slow variation is the sum of


@dataclass(frozen=True, eq=False)
class Product:
    """The score of one number at every time, by its spectrum at the offsets a = 0, 1, ... / T."""

    text: str                   # of what it is the score
    spectrum: np.ndarray        # (a,), F of a real series of q samples; F(0) is of no interest
    power: np.ndarray           # (a,), E |F|^2
    duration_s: float
    samples: int                # q
    freedom: float = np.inf     # independent values of the motion; few make heavy tails
    edge: float = 0.0           # share of the record at both ends that is left out

    def deviations(self, shapes, shares=1.0):
        """Return the standardised scores of shapes over time, (s, q), that shares (s,) decide."""
        spectra = np.fft.rfft(self._inner(shapes), axis=-1)[:, 1:len(self.spectrum)]
        score = (spectra.conj() * self.spectrum[1:]).real.sum(axis=1)
        variance = (np.abs(spectra) ** 2 * self.power[1:]).sum(axis=1) / 2
        z = score / np.sqrt(np.maximum(variance, 1e-300))       # 0 of a jump in what is left out
        return np.sign(z) * np.sqrt(2 * self._of_gaussian(z ** 2 / 2, shares))

    def without(self, constant, mean):
        """Return it without what a constant error makes of it, of such a spectrum, (a,)."""
        # `mean` is that of F(0) where there is no error
        return replace(self, spectrum=self.spectrum - (self.spectrum[0].real - mean)
                       / constant[0].real * constant[:len(self.spectrum)])

    @property
    def ratios(self):
        """Return |F|^2 over its mean, (a - 1,), without offset 0: exponential by chance."""
        return self._of_gaussian(self._squares)

    @property
    def _squares(self):
        """Return |F|^2 over its mean, the ends of the record left out, (a - 1,)."""
        spectrum = np.fft.rfft(self._inner(np.fft.irfft(self.spectrum, self.samples)))
        return np.abs(spectrum[1:]) ** 2 / self.power[1:] / (1 - 2 * self.edge)

    @property
    def scattered(self):
        """Return it with the variance that the record shows where that is above the model's."""
        # Numbers that are a deviation off leave more of a resonance than noise. The median of many
        # offsets tells, which a change in time hardly raises.
        scatter = excess_around(self._squares, np.log(2), NEAR)
        return replace(self, power=self.power * np.append(1.0, scatter))

    def _inner(self, series):
        """Return series (..., q) less their means, and 0 at the ends of the record."""
        # what a taper cuts off of slow modes is seen by many bins, which are not independent there
        share = (np.arange(self.samples) + 0.5) / self.samples
        inner = (share > self.edge) & (share < 1 - self.edge)
        return inner * (series - series[..., inner].mean(axis=-1, keepdims=True))

    def _of_gaussian(self, ratios, shares=1.0):
        """Return exponential variables as improbable as ratios to the mean of few values."""
        freedom = self.freedom * shares
        return ratios if np.isinf(self.freedom) else freedom * np.log1p(ratios / freedom)


@dataclass(frozen=True, eq=False)
class ModeProducts:
    """The Products of frequency and damping of a mode, and its energy at the same samples."""

    pair: tuple                 # Products of frequency and of damping
    clean: tuple                # the same without what goes with the energy by itself
    energy: np.ndarray          # (q,), |z|^2


def of_mode(mode, duration_s, most_hz, edge=0.0):
    """
    Return the ModeProducts of a Mode, up to an offset in Hz.

    What a constant error of its numbers makes of the products, which is their energy, is taken
    out: no model is exact. `edge` is that of a Product.
    """
    count = int(most_hz * duration_s)
    of_energy = _correlated(mode.state.conj(), mode.state, count)[count:]
    energy = np.fft.irfft(of_energy, 2 * count)
    # mu and z are correlated: the product goes with the energy
    slope = (np.delete(_correlated(mode.cross, mode.state_power, count), count).sum()
             / np.delete(_correlated(mode.state_power, mode.state_power, count), count).sum())
    clean = replace(
        mode, adjoint=mode.adjoint - slope.conj() * mode.state,
        cross=mode.cross - slope * mode.state_power,
        adjoint_power=mode.adjoint_power - 2 * (slope * mode.cross.conj()).real
        + np.abs(slope) ** 2 * mode.state_power)
    pair, clean = (_pair(m, duration_s, count, of_energy, edge)
                   for m in (mode, clean))
    return ModeProducts(tuple(p.scattered for p in pair), clean, np.maximum(energy, 0.0))


def _pair(mode, duration_s, count, constant, edge):
    both = _correlated(mode.adjoint.conj(), mode.state, count)
    power = np.maximum(_correlated(mode.adjoint_power, mode.state_power, count).real, 1e-300)
    pseudo = _correlated(mode.cross, mode.cross, count)
    ahead, behind = both[count:], both[count::-1]
    found = []
    for word, turn in (('frequency', mode.pole * 1j), ('damping', -mode.pole)):
        turn = turn / abs(turn)
        # the part of delta that is real in this direction: Re of the product
        spectrum = (turn * ahead + (turn * behind).conj()) / 2
        variance = (power[count:] + power[count::-1]) / 4 + (turn ** 2 * pseudo[count:]).real / 2
        found.append(Product(
            f'the {word} of the mode at {mode.frequency_hz:.2f} Hz', spectrum,
            np.maximum(variance, LEAST * power[count:]), duration_s, 2 * count,
            FREEDOM * mode.decays, edge).without(
                constant, float((turn * mode.cross.sum()).real)))
    return tuple(found)


def _correlated(one, two, count):
    """Return sum_f one(f) two(f + a) for a = -count, ..., count."""
    # as `scipy.signal.fftconvolve` has it, whose import alone takes half a second
    real = np.isrealobj(one) and np.isrealobj(two)
    there, back = (rfft, irfft) if real else (fft, ifft)
    size = next_fast_len(len(one) + len(two) - 1, real)
    return back(there(one[::-1], size) * there(two, size), size)[
        len(two) - 1 - count:len(two) + count]


def of_channel(record, i, most_hz, edge=0.0):
    """Return the Product of the gain of channel `i` of a RecordSpectra, up to an offset in Hz."""
    count, n = int(most_hz * record.duration_s), record.rows
    inverse = record.inverse[:, i, i].real
    spectrum = np.fft.rfft(record.series(record.adjoint[:, i]) * record.series(
        record.recorded[:, i]))
    power = np.fft.rfft(record.series(inverse) * record.series(record.power[:, i])).real / n
    return Product(f'the gain of {record.channels[i]}', spectrum[:count + 1],
                   (power + 2 * len(inverse) / n ** 2)[:count + 1], record.duration_s, 2 * count,
                   edge=edge).scattered


def modulation(products):
    """Return p-value and text of the strongest cosine of any Product."""
    ratios = np.array([p.ratios for p in products])
    which, at = np.unravel_index(np.argmax(ratios), ratios.shape)
    p_value = -np.expm1(ratios.size * np.log1p(-min(np.exp(-ratios.max()), 1 - 1e-16)))
    return float(p_value), (f'{named(products, ratios[:, at])} is modulated at '
                            f'{(at + 1) / products[which].duration_s:.3g} Hz')


def slow_variation(products):
    """Return p-value and text of the Product that varies most as the sum of slow cosines."""
    p_values = [chi2.sf(2 * p.ratios[:SLOW].sum(), 2 * SLOW) for p in products]
    best = int(np.argmin(p_values))
    p_value = -np.expm1(len(p_values) * np.log1p(-min(p_values[best], 1 - 1e-16)))
    return float(p_value), f'{products[best].text} varies slowly'


def named(products, strengths):
    """Return the text of the strongest, and of those that can hardly be distinguished from it."""
    order = np.argsort(-strengths)[:MOST_NAMED]
    return ' or '.join(products[i].text for i in order
                       if strengths[i] > NEARLY * strengths[order[0]])


def two_sided(z, trials):
    """Return the p-value of the largest of |z| in so many trials."""
    return float(-np.expm1(trials * np.log1p(-min(2 * norm.sf(np.abs(z).max()), 1 - 1e-16))))
