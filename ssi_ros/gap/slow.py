"""
What wanders slowly on one channel, below the band that the structure is looked at in, eq. (109a).

Noise of a time constant of ten seconds has all its power below 0.02 Hz, where pieces of a minute
see nothing. There the whole record is one piece, and every channel is held against what the
others say of it and against more white noise.
"""
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from ssi_ros.effects import effect_class
from ssi_ros.gap.spectra import spectra, whole_frame
from ssi_ros.gap.symptoms import moments, SURE, Symptom, within

SLOWEST = 2             # bins of the record left out, which its mean disturbs
AROUND = 3.0            # bins left out on both sides of a mode that does not settle
FASTEST_HZ = 1.0        # highest frequency looked at
TAPER_SHARE = 0.1       # of the record, at each end
TIMES, SIZES = 40, 60   # of the grid of time constants and of sizes
CELLS = 2.5             # independent time constants, by simulation


def slow_signs(simulator, fitted, samples, settings, names):
    """
    Find slow first-order noise on the channel where it is most likely.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    fitted : Fit
        The model that holds but for the noise.
    samples : Samples
        The record.
    settings : DiagnosisSettings
        Band.
    names : sequence of str
        Effects that are sought; nothing is done without `sensor_drift`.

    Returns
    -------
    tuple of Symptom
        None or one.

    """
    if 'sensor_drift' not in names:
        return ()
    present = ~np.isnan(samples.values).any(axis=1)
    rows, rate_hz = samples.values.shape[0], samples.rate_hz
    frame = replace(
        whole_frame(rows, rate_hz, settings, TAPER_SHARE * rows / rate_hz, present),
        first=SLOWEST, last=max(int(FASTEST_HZ * rows / rate_hz), SLOWEST + 1))
    side = simulator.on(frame)
    setup = side.setup(fitted.candidate, fitted.levels)
    spectrum = side.spectrum(setup).at(fitted.levels)[0]
    known = (_away_from_unsettled(setup.system.state_space, frame)
             & (np.linalg.eigvalsh(spectrum)[:, 0] > 0.0))
    inverse = np.linalg.inv(spectrum[known])
    seen = np.einsum('kij,kj->ki', inverse, spectra(samples, frame)[0][known])
    own = np.einsum('kii->ki', inverse).real
    times = np.geomspace(0.2, rows / rate_hz, TIMES)
    recall = np.exp(-1 / rate_hz / times)[:, None]
    shape = (1 - recall ** 2) / np.abs(
        1 - recall * np.exp(-2j * np.pi * frame.frequencies_hz[known] / rate_hz)) ** 2
    sizes = np.geomspace(0.1, 1e6, SIZES)       # of noise, over the least that a bin can show
    best = None
    for i, channel in enumerate(samples.channels):
        powers = sizes / np.max(shape.max(axis=0) * own[:, i])
        extra = powers[:, None, None] * shape * own[:, i]       # size, time, bin
        ratio = np.abs(seen[:, i]) ** 2 / own[:, i]
        gains = _gain(extra, ratio, frame)
        # more noise of all frequencies is not slow noise
        white = sizes[:, None] * own[:, i] / np.max(own[:, i])
        gains -= _gain(white, ratio, frame).max(initial=0.0)
        if best is None or gains.max() > best[0].max():
            best = gains, powers, channel
    gains, powers, channel = best
    p = min(1.0, CELLS * len(samples.channels) * chi2.sf(2 * max(gains.max(), 0.0), 1) / 2)
    if p > SURE:
        return ()
    weights = np.exp(gains - gains.max())
    rms, rms_std = moments(np.log(powers) / 2, weights.sum(axis=1))
    time, time_std = moments(np.log(times), weights.sum(axis=0))
    rms, time = np.exp(rms), np.exp(time)
    effect = within(effect_class('sensor_drift'), rms_m_s2=rms, time_constant_s=time)
    return (Symptom(replace(effect, channel=channel), p,
                    f'{channel} wanders by {rms:.2g} m/s^2 over {time:.2g} s',
                    {'rms_m_s2': rms * rms_std, 'time_constant_s': time * time_std}),)


def relief(simulator, fitted, samples, settings, signs):
    """
    Return the log likelihood of slow noise that is none once a fit is in the model.

    Nutation looks like it, and its bins are below the band, so that no likelihood has counted
    them.

    Parameters
    ----------
    simulator, fitted, samples, settings
        See `slow_signs`.
    signs : sequence of Symptom
        Of the model without effects.

    """
    before = next((s.p_value for s in signs if s.effect.name == 'sensor_drift'), None)
    if before is None or 'sensor_drift' in fitted.candidate.names:
        return 0.0
    still = slow_signs(simulator, fitted, samples, settings, ('sensor_drift',))
    after = still[0].p_value if still else 1.0
    return float(np.log(max(after, before, 1e-300) / max(before, 1e-300)))


def _gain(extra, ratio, frame):
    """Return the log likelihood of noise over that of what is seen, bins last."""
    return (ratio * extra / (1 + extra) - np.log1p(extra)).sum(axis=-1) / frame.crowding


def _away_from_unsettled(system, frame):
    """
    Return the bins away from modes that ring longer than the record, bool, shape (k,).

    Momentum of wheels lets the craft nutate without damping: its power grows with time, and no
    expected spectrum holds there.
    """
    poles = system.diagonal[0]
    step_hz = frame.rate_hz / frame.rows
    lines_hz = poles.imag[(poles.imag > 0) & (-poles.real < step_hz)] / (2 * np.pi)
    away = np.abs(frame.frequencies_hz[:, None] - lines_hz) > AROUND * step_hz
    return away.all(axis=1)
