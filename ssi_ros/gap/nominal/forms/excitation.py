"""Modal forms of the excitation, eq. (145); each is null at x = 0."""
import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import modal_form
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.forms.sensor import at_mode, filter_of, nyquist_share

NODES = np.linspace(-1.0, 1.0, 4)       # of log f, through which a polynomial runs
DECIBEL = 10 / np.log(10)


@modal_form('excitation_colour')
def colour(nominal):
    """Yield a first-order corner, eq. (145), and a smooth colour of any shape."""
    def corner(n, x):
        share = nyquist_share(n) ** 2
        return filter_of(n, None, np.sqrt((1 + max(-x[0], 0.0) * share)
                                          / (1 + max(x[0], 0.0) * share))), None

    def smooth(n, x):
        u = np.interp(np.log(n.cut.middles_hz), ends, (-1.0, 1.0))
        # the level is the mean of the nodes
        power = np.vander(u, len(NODES)) @ np.linalg.solve(
            np.vander(NODES), np.append(-np.sum(x), x))
        return filter_of(n, None, np.exp(np.clip(power, -20, 20) / 2)), None
    half, ends = nominal.cut.rate_hz / 2, np.log(nominal.cut.middles_hz[[0, -1]])
    corner_hz = Number('corner_hz', 'Hz', 0.1, -1e4, 1e4,
                       lambda x: half / np.sqrt(max(abs(x), 1e-12)))
    powers = [Number(f'relative_power_{at_mode(f)}', 'dB', 0.02, -20, 20, lambda x: DECIBEL * x)
              for f in np.exp(ends.mean() + NODES[1:] * np.diff(ends) / 2)]
    for numbers, change, meaning in (
            ((corner_hz,), corner, 'one excitation has a corner that the other has not'),
            (tuple(powers), smooth, 'another colour: power over its mean, cubic in log f')):
        yield Form({}, numbers, change, meaning, ModalPattern.COMMON_FILTER)
