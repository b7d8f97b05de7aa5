"""A difference of two recordings in few bands, which a mean over all of them hardly shows."""
import numpy as np

from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.inference.goodness_of_fit import divergence, floor_of_band
from ssi_ros.tails import gamma

WIDTHS = 2, 64          # bands: a line is in one
WIDTHS_FREED = 4, 16    # levels that are estimated are a little wrong in wide and in single ones
OVERLAP = 2.0                   # independent stretches, over those side by side


def local_difference(recordings, prediction, record):
    """
    Return the Detection of the stretch of bands that differs most, eq. (141a), or None.

    Parameters
    ----------
    recordings : Recordings
        That it is of.
    prediction : Prediction
        The reference as an effect changes it, at the levels of the record.
    record : Spectra
        Of the record, without what masks bands of it.

    Returns
    -------
    Detection
        Its p-value is for any stretch, of a length that is a power of two; None of motion that
        repeats, whose periods are not independent.

    """
    nominal, n = recordings.nominal, record.freedom
    if recordings.repeats is not None:
        return None
    before = np.broadcast_to(prediction.freedom(recordings.one.freedom), record.cut.bands)
    distance = divergence(prediction.mean, record.mean, before, n)
    floor, std = floor_of_band(n, record.mean.shape[-1], before)
    # all bands may differ a little more than theory says; what differs in few is beside that
    ratio = 1 + nominal.trust * (distance / floor - 1)
    ratio /= max(1.0, float(np.median(ratio)))
    spread = nominal.law * np.square(std / floor)
    found, (width, widest) = [], WIDTHS if recordings.turn is None else WIDTHS_FREED
    while width <= min(len(ratio) // 2, widest):
        mean, variance = (np.convolve(v, np.ones(width) / width, 'valid') for v in (
            ratio, spread))
        p_values = gamma.sf(mean, width / variance, scale=variance / width)
        k = int(np.argmin(p_values))
        found.append((OVERLAP * len(ratio) / width * p_values[k], k, width))
        width *= 2
    if not found:
        return None
    p_value, k, width = min(found)
    hz, at = record.cut.middles_hz, np.s_[k:k + width]
    powers = [np.einsum('bii->i', m[at]).real for m in (record.mean, prediction.mean)]
    change = 10 * np.log10(np.maximum(powers[0], 1e-300) / np.maximum(powers[1], 1e-300))
    i = int(np.argmax(np.abs(change)))
    return Detection(
        '', {}, float(min(1.0, len(found) * p_value)),
        f'The spectra differ from {hz[k]:.4g} to {hz[k + width - 1]:.4g} Hz by more than chance, '
        f'most in channel {recordings.pair.channels[i]} ({change[i]:+.1f} dB).', basis='bands')
