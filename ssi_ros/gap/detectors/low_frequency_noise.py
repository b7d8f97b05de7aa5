"""
First-order noise of one channel below the band that the structure is fitted in, eq. (109a).

Noise of a time constant of ten seconds has all its power below 0.02 Hz, where segments of a minute
have no bin. There the whole record is one segment, and every channel is compared with what the
others predict of it, and with more white noise.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.effects.registry import detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors.input_reconstruction import moments
from ssi_ros.gap.detectors.thresholds import LIMITS
from ssi_ros.gap.spectra.segmentation import spectra, whole_frame
from ssi_ros.tails import chi2

SLOWEST = 2             # lowest bins of the record, not used: its mean disturbs them
AROUND = 3.0            # bins not used on both sides of a mode that does not settle
TAPER_SHARE = 0.1       # of the record, at each end
TIMES, SIZES = 40, 60   # of the grid of time constants and of sizes
FASTEST_S = 0.2         # shortest time constant of the grid


@detects('sensor_drift', of='spectrum')
def detect_low_frequency_noise(effect, simulator, fitted, samples, settings):
    """Detect slow first-order noise on the channel where noise of any kind is most likely."""
    duration_s = len(samples.values) / samples.rate_hz
    times = np.geomspace(FASTEST_S, duration_s, TIMES)
    gains, powers, channel = noisiest(_grids(simulator, fitted, samples, settings, times))
    trials = LIMITS.drift_trials.value * len(samples.channels)
    p_value = min(1.0, trials * chi2.sf(2 * max(gains.max(), 0.0), 1) / 2)
    if p_value > LIMITS.p_value.value:
        return None
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


def _grids(simulator, fitted, samples, settings, times):
    """
    Yield what noise explains in every channel, the powers of its sizes [(m/s^2)^2], the channel.

    First the log likelihoods of slow noise, (sizes, times), then that of white noise, its best.
    """
    rows, rate_hz = samples.values.shape[0], samples.rate_hz
    frame = replace(
        whole_frame(rows, rate_hz, settings, TAPER_SHARE * rows / rate_hz),
        first=SLOWEST,
        last=max(int(LIMITS.drift_fastest_hz.value * rows / rate_hz), SLOWEST + 1))
    side = simulator.on(frame)
    setup = side.setup(fitted.candidate, fitted.levels)
    spectrum = side.spectrum(setup).at(fitted.levels)[0]
    known = (_away_from_unsettled(setup.system.state_space, frame)
             & (np.linalg.eigvalsh(spectrum)[:, 0] > 0.0))
    inverse = np.linalg.inv(spectrum[known])
    filtered = np.einsum('kij,kj->ki', inverse, spectra(samples, frame)[0][known])
    own = np.einsum('kii->ki', inverse).real
    recall = np.exp(-1 / rate_hz / times)[:, None]
    shape = (1 - recall ** 2) / np.abs(
        1 - recall * np.exp(-2j * np.pi * frame.frequencies_hz[known] / rate_hz)) ** 2
    sizes = np.geomspace(0.1, 1e6, SIZES)       # of noise, over the least that a bin can show
    for i, channel in enumerate(samples.channels):
        powers = sizes / np.max(shape.max(axis=0) * own[:, i])
        extra = powers[:, None, None] * shape * own[:, i]       # size, time, bin
        ratio = np.abs(filtered[:, i]) ** 2 / own[:, i]
        white = sizes[:, None] * own[:, i] / np.max(own[:, i])
        yield (_gain(extra, ratio, frame), _gain(white, ratio, frame).max(initial=0.0), powers,
               channel)


def _gain(extra, ratio, frame):
    """Return the log likelihood of noise over that of none, bins last."""
    return (ratio * extra / (1 + extra) - np.log1p(extra)).sum(axis=-1) / frame.inflation


def _away_from_unsettled(system, frame):
    """
    Return the bins away from modes that decay more slowly than the record lasts, bool, shape (k,).

    Momentum of wheels lets the craft nutate without damping: its power grows with time, and no
    expected spectrum holds there.
    """
    poles = system.diagonal[0]
    step_hz = frame.rate_hz / frame.rows
    lines_hz = poles.imag[(poles.imag > 0) & (-poles.real < step_hz)] / (2 * np.pi)
    away = np.abs(frame.frequencies_hz[:, None] - lines_hz) > AROUND * step_hz
    return away.all(axis=1)
