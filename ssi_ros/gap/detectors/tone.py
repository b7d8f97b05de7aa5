"""Lines: a sine of the input, and a line that no input makes, eq. (106)."""
import numpy as np

from ssi_ros.effects.registry import deflection, detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors.thresholds import LIMITS
from ssi_ros.tails import chi2, gamma, tail_of_highest
from ssi_ros.updating.resonance_doubt import discounted
from ssi_ros.windows import excess_around, peak_near

NEIGHBOURS, MOVED = 33, 2.0     # lines, and what they have over a model where a mode has moved
BETWEEN = 1.5           # independent frequencies a bin, where those between two are searched too


@detects('harmonic_disturbance', of='input')
def detect_tone(effect, reconstruction):
    """Detect the strongest sine of the input, eq. (106)."""
    one = reconstruction
    # a gap may be filled with a sine or without one
    series = np.concatenate([np.where(one.missing, 0.0, one.tapered(one.machine)),
                             np.zeros(one.rows)])
    last = one.first + len(one.machine)
    # twice as many bins: a sine between two of them keeps 90 % of its power
    fine = np.fft.rfft(series)[2 * one.first:2 * last - 1]
    power = np.abs(fine) ** 2
    # a strong line has raised the levels that the input was whitened by
    scale = np.median(power[::2]) / np.log(2)
    power /= scale
    doubt = np.interp(np.arange(len(power)) / 2, np.arange(len(one.doubt)), one.doubt)
    rare = discounted(power, doubt)
    rare /= excess_around(rare, np.log(2), 2 * NEIGHBOURS, MOVED)
    best = int(np.argmax(rare))
    trials = BETWEEN * len(one.machine)
    p_value = tail_of_highest(rare[best], trials)
    if p_value > LIMITS.p_value.value:
        return None
    frequency, top = peak_near(series[:one.rows], best / 2 + one.first)
    top /= scale
    gain = np.interp(frequency, np.arange(one.first, last), one.machine_gain)
    amplitude = 2 * np.sqrt(scale * max(top - 1.0, 0.0)) / gain / np.sum(one.taper[~one.missing])
    frequency_hz = frequency * one.rate_hz / one.rows
    size = np.sqrt(2 * top)
    stds = {'torque_n_m': amplitude / size,
            'frequency_hz': np.sqrt(6) / np.pi / size * one.rate_hz / one.rows}
    return Detection.of_effect(
        effect.within(frequency_hz=frequency_hz, torque_n_m=amplitude), p_value,
        f'The input has a line at {frequency_hz:.5g} Hz '
        f'({np.sqrt(2 * rare[best]):.1f} standard deviations).', stds=stds, trials=round(trials))


@deflection('harmonic_disturbance')
def tone_deflection(effect, sensitivity):
    """Return d' of a sine."""
    return sensitivity.of_sine(effect.torque_n_m, effect.frequency_hz, effect.frequency_hz)


def anomalous_line(reconstruction):
    """Detect a line that no input makes: power beside the response to the input."""
    trials = BETWEEN * len(reconstruction.power)
    rare = discounted(reconstruction.power, reconstruction.doubt)
    usual = chi2.isf(0.5, 2 * (free := reconstruction.white.shape[1] - 1)) / 2
    chances = gamma.sf(rare / excess_around(rare, usual, NEIGHBOURS, MOVED), free)
    best = int(np.argmin(chances))
    p_value = float(min(1.0, trials * chances[best]))
    if p_value >= LIMITS.p_value.value:
        return None
    at = (reconstruction.first + best) * reconstruction.rate_hz / reconstruction.rows
    return Detection('', {'frequency_hz': at}, p_value,
                     f'The record has a line at {at:.5g} Hz that no input makes.',
                     trials=round(trials), basis='line')
