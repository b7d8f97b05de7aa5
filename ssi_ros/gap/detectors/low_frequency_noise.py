"""
First-order noise of one channel below the band that the structure is fitted in, eq. (109a).

Noise of a time constant of ten seconds has all its power below 0.02 Hz, where segments of a minute
have no bin. There the whole record is one segment, and every channel is compared with what the
others predict of it, and with more white noise.
"""
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ssi_ros.arrays import moments
from ssi_ros.effects.registry import detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors.thresholds import LIMITS
from ssi_ros.gap.spectra.segmentation import spectra, whole_frame
from ssi_ros.tails import chi2
from ssi_ros.windows import centred

SLOWEST = 2             # lowest bins of the record, not used: its mean disturbs them
AROUND = 3.0            # bins not used on both sides of a mode that does not settle
TAPER_SHARE = 0.1       # of the record, at each end
TIMES = 40              # of the grid of time constants
SIZES = np.geomspace(0.1, 1e6, 60, dtype=np.float32)    # of the grid of sizes
FASTEST_S = 0.2         # shortest time constant of the grid


@detects('sensor_drift', of='spectrum')
def detect_low_frequency_noise(effect, simulator, fitted, samples, settings):
    """Detect slow first-order noise on the channel where noise of any kind is most likely."""
    gains, powers, channel = noisiest(_grids(simulator, fitted, samples, settings))
    trials = LIMITS.drift_trials.value * len(samples.channels)
    p_value = min(1.0, trials * chi2.sf(2 * max(gains.max(), 0.0), 1) / 2)
    if p_value > LIMITS.p_value.value:
        return None
    times = _times(len(samples.values) / samples.rate_hz)
    weights = np.exp(gains - gains.max())
    rms, rms_std = moments(np.log(powers) / 2, weights.sum(axis=1))
    time, time_std = moments(np.log(times), weights.sum(axis=0))
    rms, time = np.exp(rms), np.exp(time)
    return Detection.of_effect(
        effect.within(channel=channel, rms_m_s2=rms, time_constant_s=time), float(p_value),
        f'Channel {channel} drifts by {rms:.2g} m/s^2 (rms) with a time constant of {time:.2g} s.',
        stds={'rms_m_s2': rms * rms_std, 'time_constant_s': time * time_std},
        trials=round(trials))


def noisiest(grids):
    """
    Return the log likelihoods of slow noise over white noise, (sizes, times), where most noise is.

    What the others do not predict of a channel holds noise of theirs as well, in another colour:
    the channel is that of most noise, slow or white, whose slowness is asked for then.
    """
    gains, white, powers, channel = max(grids, key=lambda g: max(g[0].max(), g[1]))
    return gains - white, powers, channel


def _grids(simulator, fitted, samples, settings):
    """
    Yield what noise explains in every channel, the powers of its sizes [(m/s^2)^2], the channel.

    First the log likelihoods of slow noise, (sizes, times), then that of white noise, its best.
    """
    frame, known, inverse, beside = _noise(simulator, fitted, len(samples.values), settings)
    # the plain mean is most of all what velocities at both ends differ by, which a taper takes out
    samples = replace(samples, values=centred(samples.values, frame.taper))
    filtered = np.einsum('kij,kj->ki', inverse, spectra(samples, frame)[0][known])
    for channel, x, (own, powers, *both) in zip(samples.channels, filtered.T, beside):
        power = np.float32(np.abs(x) ** 2 / own / frame.inflation)
        # of all sizes at once the shapes of half an hour would take 70 MB
        slow, white = (np.array([s * shape / (1 + s * shape) @ power for s in SIZES]) - rest
                       for shape, rest in both)
        yield slow, white.max(initial=0.0), powers, channel


@lru_cache(maxsize=2)       # the blocks of a long record are of one length
def _noise(simulator, fitted, rows, settings):
    """
    Return frame, bins that are used, inverse spectrum in them, and noise beside every channel.

    That is the inverse power of what the others do not predict, the powers of the sizes, and of
    slow and white noise the spectrum of the least size and the log likelihood without power.
    """
    rate_hz = simulator.spacecraft.rate_hz
    frame = replace(
        whole_frame(rows, rate_hz, settings, TAPER_SHARE * rows / rate_hz),
        first=SLOWEST,
        last=max(int(LIMITS.drift_fastest_hz.value * rows / rate_hz), SLOWEST + 1))
    side = simulator.on(frame)
    setup = side.setup(fitted.candidate, fitted.levels)
    spectrum = side.spectrum(setup).at(fitted.levels)[0]
    # near modes that outlast the record no expected spectrum holds: their power grows with time
    lines_hz = setup.system.state_space.lasting_hz(rows / rate_hz)
    away = np.abs(frame.frequencies_hz[:, None] - lines_hz) > AROUND * rate_hz / rows
    known = away.all(axis=1) & (np.linalg.eigvalsh(spectrum)[:, 0] > 0.0)
    inverse = np.linalg.inv(spectrum[known])
    recall = np.exp(-1 / rate_hz / _times(rows / rate_hz))[:, None]
    shape = (1 - recall ** 2) / np.abs(
        1 - recall * np.exp(-2j * np.pi * frame.frequencies_hz[known] / rate_hz)) ** 2
    found = []
    for own in np.einsum('kii->ik', inverse).real:
        most = np.max(shape.max(axis=0) * own)      # sizes are over the least that a bin can show
        both = np.float32(shape * own / most), np.float32(own / np.max(own))
        found.append((own, SIZES / most, *((x, np.array([
            np.log1p(s * x).sum(axis=-1, dtype=float) for s in SIZES]) / frame.inflation)
            for x in both)))
    return frame, known, inverse, found


def _times(duration_s):
    """Return the time constants of the grid [s]."""
    return np.geomspace(FASTEST_S, duration_s, TIMES)
