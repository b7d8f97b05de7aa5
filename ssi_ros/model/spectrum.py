"""The expected spectrum of what the sensors record, eq. (30) and (31) of docs/theory.md."""
import numpy as np

from ssi_ros.model.excitation import total_covariance


def output_spectrum(system, frequencies_hz, rate_hz=None, excitation=None):
    """
    Compute the two-sided spectral density matrix of the sampled channels.

    It is exact for what `simulate` draws: inputs held, outputs sampled, aliases included. Only
    random, stationary excitation counts; lines and single events have no density.

    Parameters
    ----------
    system : System
        Structure, excitation and sensor chain.
    frequencies_hz : ndarray, shape (f,), [Hz]
        Where to evaluate it, from 0 to half of the rate.
    rate_hz : float, optional
        Sampling rate in place of the system's own [Hz].
    excitation : tuple, optional
        Parts that act in place of the system's own.

    Returns
    -------
    ndarray, shape (f, l, l), complex, [(m/s^2)^2/Hz]

    """
    rate_hz = system.rate_hz if rate_hz is None else rate_hz
    parts = system.excitation if excitation is None else excitation
    covariance = total_covariance(parts, rate_hz, system.inputs)
    response = system.transfer(frequencies_hz, rate_hz)
    count = len(system.channels)
    noise = np.zeros((1, count, count))
    for stage in system.chain:
        through = stage.response(np.asarray(frequencies_hz), count)
        response = through @ response
        noise = through @ noise @ np.conj(np.swapaxes(through, 1, 2))
        noise = noise + stage.noise_covariance(count)
    outputs = response @ covariance @ np.conj(np.swapaxes(response, 1, 2))
    return (outputs + noise) / rate_hz


def gains_of(system):
    """Return what the stages of a chain make of the channels, (l, l)."""
    count = len(system.channels)
    found = np.eye(count)
    for stage in system.chain:
        found = stage.response(np.zeros(1), count)[0] @ found
    return found
