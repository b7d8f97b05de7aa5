"""Curves: a channel that is no straight line of its motion, a mode that is stiffer to one side."""
import numpy as np
from numpy.polynomial.hermite_e import hermeval

from ssi_ros.open_set.products import two_sided
from ssi_ros.tails import chi2

ORDERS = 2, 3, 4, 5     # of the polynomials of a channel


def _standardised(adjoint, power, spectrum):
    """Return the score of a series with such a spectrum, over its deviation."""
    return float((adjoint.conj() * spectrum).real.sum() / np.sqrt(
        (power * np.abs(spectrum) ** 2).sum() / 2))


def _apart(record, edge):
    """Return 1 where samples are apart from the ends of a record, (n,), else 0."""
    # slow modes that a taper cuts off ring on at low frequencies, where a square has its power
    apart, count = np.zeros(record.rows), round(edge * record.rows)
    apart[count:record.rows - count] = 1.0
    return apart


def _quadratic_forms(matrices, vectors):
    """Return v^H A v of Hermitian A (k, l, l) and m vectors (l,), (k, m), as one real product."""
    outer = np.array([np.outer(v.conj(), v).conj().ravel() for v in vectors])
    return matrices.view(float).reshape(len(matrices), -1) @ outer.view(float).T


def channel_curve(record, edge):
    """Return p-value and text of the channel whose values follow a curve, or lag like play."""
    p_values, apart = [], _apart(record, edge)
    for i in range(len(record.channels)):
        y, v = record.series(record.recorded[:, i]), record.adjoint[:, i]
        power, unit = record.inverse[:, i, i].real, y / y.std()
        rate = np.gradient(unit)
        z = [_standardised(v, power, record.spectrum(apart * hermeval(unit, np.eye(k + 1)[k])))
             for k in ORDERS]
        lag = _standardised(v, power, record.spectrum(
            apart * hermeval(rate / rate.std(), [0, 0, 0, 1])))
        p_values += [chi2.sf(np.sum(np.square(z)), len(z)), two_sided(np.array([lag]), 1)]
    best = int(np.argmin(p_values))
    channel = record.channels[best // 2]
    return min(1.0, len(p_values) * p_values[best]), (
        f'channel {channel} has play: it lags as its rate turns' if best % 2 else
        f'channel {channel} follows a curve, no straight line')


def asymmetry(record, modes, edge):
    """Return p-value and text of the mode that is stiffer to one side than to the other."""
    z, f = [], record.frequencies_hz
    apart = _apart(record, edge)
    around = np.exp(2j * np.pi * f / record.rate_hz)
    of_shapes = _quadratic_forms(record.inverse, [m.shape for m in modes])
    for mode, of_shape in zip(modes, of_shapes.T):
        gain = 1 / (around - mode.pole)
        adjoint = gain.conj() * (record.adjoint @ mode.shape.conj())
        power = np.abs(gain) ** 2 * of_shape
        state = np.zeros(len(f), complex)
        state[mode.bins] = mode.state * mode.displaced
        q = record.series(state)
        spectrum = record.spectrum(apart * hermeval(q / q.std(), [0, 0, 1]))
        turn = mode.displaced.conjugate() / abs(mode.displaced)
        z.append(_standardised(adjoint * turn, power, spectrum))
    best = int(np.argmax(np.abs(z)))
    return two_sided(np.array(z), len(z)), (
        f'the mode at {modes[best].frequency_hz:.2f} Hz is stiffer to one side')
