"""Weigh an amplitude-dependent joint against a plain change of the structure, eq. (157)."""
import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import showing
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.structure import amplitude_dependent
from ssi_ros.gap.nominal.modal.amplitude_dependence import significance
from ssi_ros.gap.nominal.modal.reference import modes_of, moves
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.hermitian import positive
from ssi_ros.scipy_later import uniform_filter1d

NEIGHBOURS = 15         # bands over which the distortion of a nonlinearity is smoothed
WORDS = {
    ModalPattern.HARDENING: 'frequencies rise with the amplitude: hardening, or free play that '
                            'closes',
    ModalPattern.SOFTENING: 'frequencies fall with the amplitude: clearance that opens, or slip'}


def joint(recordings):
    """
    Return the Detection of a nonlinear joint, or None, and the log odds of its bursts.

    Two observations count: power far from the modes that follows the phase of a mode and grows
    faster than the level; a frequency that depends on the amplitude inside the record. Modes that
    are elsewhere at another level show no law. An effect not considered has the same text alone.
    """
    nominal, base, two = recordings.nominal, recordings.null, recordings.two
    frequencies_hz = nominal.modes.frequencies_hz
    if not len(frequencies_hz):
        return None, 0.0
    dependence, level = recordings.dependence, recordings.level
    added, share = _distortion(base, two.mean)
    locked = dependence.bursts / np.maximum(dependence.burst_stds, 1e-300)
    distorted = (share.max() > LIMITS.distortion.value and level > LIMITS.other_level.value
                 and locked.max() > LIMITS.phase_locked.value)
    slopes = len(frequencies_hz) * significance(dependence.frequency_slopes,
                                                dependence.frequency_stds)
    k = int(np.argmin(slopes))
    sloped = slopes[k] < LIMITS.detected.value
    if not (distorted or sloped):
        return None, 0.0
    pattern = level_law(recordings, dependence.frequency_slopes[k] if sloped else None)
    texts, bonus, bursts = [], 0.0, 0.0
    if distorted:
        bursts = float(locked.max()) ** 2 / 2
        bonus += bursts
        texts.append(_text_of_bursts(nominal, share, locked))
    if sloped:
        bonus += min(LIMITS.certain_odds.value, -np.log(max(slopes[k], 1e-300)))
        texts.append(f'inside the record the mode at {frequencies_hz[k]:.4g} Hz changes by '
                     f'{100 * dependence.frequency_slopes[k]:+.2g} % where its amplitude grows '
                     'e-fold')
    form = amplitude_dependent(nominal, pattern, added if distorted else None, WORDS[pattern],
                               bonus)
    name = next((n for n in showing(pattern) if n in recordings.effects), '')
    return Detection(name, {}, float(np.exp(-bonus)), '; '.join(texts), weak=True,
                     basis=lambda r: (form,)), bursts


def level_law(recordings, rise=None):
    """Return whether frequencies rise with the level or fall, as `rise` or the recordings say."""
    if rise is None:
        nominal = recordings.nominal
        rise = np.sum(moves(nominal.modes, modes_of(nominal, recordings.record_modes)))
        rise *= 1.0 if recordings.level > 0 else -1.0
    return ModalPattern.HARDENING if rise > 0 else ModalPattern.SOFTENING


def _text_of_bursts(nominal, share, locked):
    channel, worst = nominal.channels[share.argmax()], int(np.argmax(locked))
    return (f'{100 * share.max():.2g} % of the power of {channel} is distortion that the level '
            'does not explain; it follows the phase of the mode at '
            f'{nominal.modes.frequencies_hz[worst]:.4g} Hz ({locked[worst]:.0f} sd)')


def _distortion(base, observed):
    """Return power beyond the level, (b, l, l) at the reference's, and its share (l,), (157)."""
    # Only bands count where it outweighs what the level explains: a resonance that moved is not
    # distortion.
    there = np.einsum('bii->bi', observed).real
    usual = np.einsum('bii->bi', base.prediction.mean).real
    ratio = uniform_filter1d(there, NEIGHBOURS, axis=0) / uniform_filter1d(usual, NEIGHBOURS, 0)
    mostly = np.median(ratio, axis=1) > LIMITS.mostly_distortion.value
    added = positive(np.where(mostly[:, None, None], observed - base.prediction.mean, 0.0))
    share = np.einsum('bii->i', added).real / there.sum(axis=0)
    return added / np.exp(base.x[0]), share
