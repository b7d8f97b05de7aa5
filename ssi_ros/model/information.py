"""
What a second of record tells about the modes: Fisher information, eq. (32) to (34).

Whittle's likelihood of the expected spectrum, as a function of the frequency, the damping ratio
and the level of every mode at once. The level is unknown because the excitation is not measured.
Source: Whittle 1953; for stationary records Kay, Fundamentals of Statistical Signal Processing,
1993, section 3.11.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.model.excitation import total_covariance

FLOOR = 1e-9        # of the mean power, added to every channel: no sensor is without noise


@dataclass(frozen=True, eq=False)
class ModalView:
    """
    Vibration modes as one excitation drives them and as all freedoms feel them.

    Attributes
    ----------
    frequencies_hz, damping_ratios : ndarray, shape (n,)
        Natural frequencies [Hz] and damping ratios [1], rising.
    drive : ndarray, shape (n, m), complex
        Sampled input vectors, scaled by the square root of the input covariance.
    motion : ndarray, shape (dofs, n), complex
        Acceleration (or displacement) of the freedoms in every mode.
    direct : ndarray, shape (dofs, m)
        Direct feedthrough, scaled like `drive`.
    rate_hz : float
        Sampling rate [Hz].

    """

    frequencies_hz: np.ndarray
    damping_ratios: np.ndarray
    drive: np.ndarray
    motion: np.ndarray
    direct: np.ndarray
    rate_hz: float

    @property
    def eigenvalues(self):
        """Return lambda of every mode [rad/s]."""
        omega = 2 * np.pi * self.frequencies_hz
        xi = self.damping_ratios
        return omega * (-xi + 1j * np.sqrt(1 - xi ** 2))

    def amplitudes(self, rows):
        """Return the rms that each mode alone gives to each channel, shape (l, n)."""
        poles = np.exp(self.eigenvalues / self.rate_hz)
        power = np.linalg.norm(self.drive, axis=1) ** 2 / (1 - np.abs(poles) ** 2)
        return np.abs(rows @ self.motion) * np.sqrt(2 * power)


def modal_view(system, excitation=None, rate_hz=None, at_channels=False):
    """
    Return the modes of a system as its excitation drives them (its filters left out).

    With `at_channels` their motion is what the channels measure, whatever that is, in place of the
    accelerations of the freedoms.
    """
    rate_hz = system.rate_hz if rate_hz is None else rate_hz
    parts = system.excitation if excitation is None else excitation
    level = np.sqrt(np.diag(total_covariance(parts, rate_hz, system.inputs)))
    whole = system if at_channels else replace(
        system, sensor=np.eye(len(system.dofs)), channels=system.dofs)
    values, _, _ = whole.plant.diagonal
    sampled = whole.plant.discrete(rate_hz)
    values = values[values.imag >= 0]
    keep = np.flatnonzero(values.imag > 0)
    keep = keep[np.argsort(np.abs(values[keep]))]
    values = values[keep]
    return ModalView(np.abs(values) / (2 * np.pi), -values.real / np.abs(values),
                     sampled.b[keep] * level, sampled.c[:, keep], sampled.d * level, rate_hz)


def information(view, rows, noise_rms, modes=None, points=31):
    """
    Compute the Fisher information of one second of record.

    Parameters
    ----------
    view : ModalView
        The modes and their excitation.
    rows : ndarray, shape (l, dofs)
        Displacement rows of the sensors.
    noise_rms : ndarray, shape (l,), [m/s^2]
        White noise of every channel at the rate of the view.
    modes : sequence of int, optional
        Modes that are unknown; all if not given.
    points : int
        Frequencies a mode at which the integral is taken.

    Returns
    -------
    ndarray, shape (3 n, 3 n), [1/s]
        For relative frequency, relative damping ratio and relative level of every mode, in that
        order: all frequencies first.

    """
    modes = np.arange(len(view.frequencies_hz)) if modes is None else np.asarray(modes)
    grid, weights = _grid(view, points)
    rate, values = view.rate_hz, view.eigenvalues
    poles = np.exp(values / rate)
    z = np.exp(2j * np.pi * grid / rate)
    c = rows @ view.motion
    residues = c.T[:, :, None] * view.drive[:, None, :]              # (n, l, m)
    ahead = 1 / (z[:, None] - poles)
    back = 1 / (z[:, None] - poles.conj())
    n, size = len(poles), residues[0].size
    flat = residues.reshape(n, size)
    response = (ahead @ flat + back @ flat.conj()).reshape(len(grid), *residues[0].shape)
    response = response + rows @ view.direct
    density = response @ response.conj().swapaxes(1, 2)
    floor = FLOOR * np.einsum('fii->f', density).real.mean() / len(rows)
    density = density + np.diag(np.asarray(noise_rms) ** 2 + floor)
    whiten = np.linalg.inv(np.linalg.cholesky(density))
    # Letters of eq. (33): per mode, d mu for a relative change of f and of xi.
    xi, omega = view.damping_ratios, np.abs(values)
    by_f = poles * values / rate
    by_xi = poles * omega * xi * (-1 - 1j * xi / np.sqrt(1 - xi ** 2)) / rate
    seen = (whiten @ response).conj()                                # conj(L^-1 H)
    columns = []
    for change in (by_f, by_xi, None):
        for i in modes:
            a, b = ahead[:, i], back[:, i]
            if change is not None:
                a, b = change[i] * a ** 2, change[i].conj() * b ** 2
            # dH = a r + b conj(r), r = c_i b_i^T of rank one: work with its two factors.
            cw = whiten @ c[:, i]
            cw_conj = whiten @ c[:, i].conj()
            ra, rb = seen @ view.drive[i], seen @ view.drive[i].conj()      # b^T H^H L^-H
            half = (a[:, None, None] * cw[:, :, None] * ra[:, None, :]
                    + b[:, None, None] * cw_conj[:, :, None] * rb[:, None, :])
            whole = half + half.conj().swapaxes(1, 2)
            columns.append((np.sqrt(weights)[:, None, None] * whole).ravel())
    scores = np.array(columns)
    return (scores.conj() @ scores.T).real


def _grid(view, points):
    """Return frequencies, dense about every resonance, and their weights for an integral."""
    angle = np.linspace(-1.5, 1.5, points)
    near = view.frequencies_hz[:, None] * (1 + view.damping_ratios[:, None] * np.tan(angle))
    wide = np.linspace(0.0, view.rate_hz / 2, 8 * points)[1:-1]
    grid = np.concatenate([near.ravel(), wide])
    grid = np.unique(grid[(grid > 0) & (grid < view.rate_hz / 2)])
    return grid, np.gradient(grid)


def spreads(info, modes):
    """
    Return the least relative standard deviations that one second of record allows.

    Frequencies, then damping ratios, each shape (n,), [s^0.5]: divide by the root of the length.
    """
    scale = np.sqrt(np.maximum(np.diag(info), 1e-300))
    inverse = np.linalg.pinv(info / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    variance = np.diag(inverse) / scale ** 2
    return np.sqrt(variance[:modes]), np.sqrt(variance[modes:2 * modes])
