"""Modal forms of the excitation, eq. (145); each is null at x = 0."""
import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import modal_form
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.forms.sensor import filter_of, nyquist_share

ORDERS = 'slope', 'curvature', 'third_order'       # Legendre polynomials of log f
DECIBEL = 10 / np.log(10)


@modal_form('excitation_colour')
def colour(nominal):
    """Yield a first-order corner, eq. (145), and a smooth colour of any shape."""
    def corner(n, x):
        share = nyquist_share(n) ** 2
        return filter_of(n, None, np.sqrt((1 + max(-x[0], 0.0) * share)
                                          / (1 + max(x[0], 0.0) * share))), None

    def smooth(n, x):
        u = np.log(n.cut.middles_hz)
        u = 2 * (u - u[0]) / (u[-1] - u[0]) - 1
        power = sum(c * np.polynomial.legendre.Legendre.basis(k + 1)(u) for k, c in enumerate(x))
        return filter_of(n, None, np.exp(np.clip(power, -20, 20) / 2)), None
    half = nominal.cut.rate_hz / 2
    corner_hz = Number('corner_hz', 'Hz', 0.1, -1e4, 1e4,
                       lambda x: half / np.sqrt(max(abs(x), 1e-12)))
    powers = [Number(f'power_{k}', 'dB', 0.02, -20, 20, lambda x: DECIBEL * x) for k in ORDERS]
    for numbers, change, meaning in (
            ((corner_hz,), corner, 'one excitation has a corner that the other has not'),
            (tuple(powers), smooth, 'another colour: power as a polynomial of log f')):
        yield Form({}, numbers, change, meaning, ModalPattern.COMMON_FILTER)
