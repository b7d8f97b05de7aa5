"""Frequencies that depend on the amplitude: joints that soften, friction, play."""
import numpy as np

from ssi_ros.open_set.outliers import of_kurtosis
from ssi_ros.open_set.products import two_sided

POWERS = 1.0, 0.5       # of the energy, with which a frequency may go
SCATTER = 1.4, 1.15     # of the scores over theory, whose shapes are not independent of them
# A damping that goes with the energy is not asked for: the scatter of its score over theory, 0.25
# where the model is exact, is several times that beside a damping that a calibration has moved.


def dependence_on_amplitude(modes):
    """Return p-value and text of the clearest dependence on amplitude of any ModeProducts."""
    if not modes:
        return 1.0, ''
    z = []
    for mode in modes:
        shapes = mode.energy ** np.array(POWERS)[:, None]
        shapes = shapes - shapes.mean(axis=1, keepdims=True)
        z.append(mode.clean[0].deviations(shapes) / np.array(SCATTER))
    z = np.array(z)
    r, which = np.unravel_index(np.argmax(np.abs(z)), z.shape)
    # the two powers of one energy are nearly one test
    return two_sided(z, 1.5 * len(z)), (
        f'{modes[r].clean[0].text} {"rises" if z[r, which] > 0 else "falls"} with its amplitude')


def distribution(modes):
    """Return p-value and text of the Mode whose energy is not distributed as that of noise."""
    if not modes:
        return 1.0, ''
    z = []
    for mode in modes:
        # Laguerre polynomial of second order of the energy over its mean
        size = 2 ** int(np.ceil(np.log2(4 * len(mode.state))))
        series = np.fft.ifft(mode.state, size)
        energy = np.abs(series) ** 2
        energy = energy / energy.mean()
        correlation = np.fft.ifft(mode.state_power, size)
        correlation = np.abs(correlation / correlation[0]) ** 2
        score = (energy ** 2 / 2 - 2 * energy + 1).sum()
        variance = size * (correlation ** 2).sum()
        # the third moment of the polynomial is 10
        third = 10 * (np.fft.fft(correlation).real ** 3).sum()
        z.append(of_kurtosis(score / np.sqrt(variance), third / variance ** 1.5))
    best = int(np.argmax(np.abs(z)))
    return two_sided(np.array(z), len(z)), (
        f'the amplitude of the mode at {modes[best].frequency_hz:.2f} Hz is '
        f'{"more" if z[best] > 0 else "less"} uneven than that of noise')
