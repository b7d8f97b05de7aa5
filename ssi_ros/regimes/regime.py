"""
What kind of motion two recordings hold, and which effects an answer may then name.

The forms of effects are those of modes under random forces. Where the recordings show that this
is not what they hold, only what is known beside them is said: a place, a time, or that nothing is.
"""
from dataclasses import dataclass

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.base import Site
from ssi_ros.regimes.decays import moved, unresolved
from ssi_ros.regimes.thresholds import LIMITS

# power that comes at random, and is another in every period
RANDOM = (ModalPattern.CHANNEL_NOISE, ModalPattern.IMPULSES, ModalPattern.CHIRP,
          ModalPattern.SAMPLING)
NOWHERE = 'unknown'     # no site: where the difference lies cannot be said


@dataclass(frozen=True)
class Regime:
    """What two recordings are, as far as it limits an answer."""

    refusal: str = ''       # why they cannot be compared as random motion; empty if they can
    site: str = ''          # where they differ, as far as that is known; empty: by the scores
    texts: tuple = ()       # what was found, in sentences
    structural: bool = False    # whether only a change of the structure explains the difference
    repeated: bool = False      # whether what is more than in the reference repeats itself
    carried: bool = False       # whether both are one vibration, of which modes do not tell

    @property
    def unsteady(self):
        """Whether spectra of the recordings do not scatter as those of random motion."""
        return self.carried or bool(self.refusal)

    def allows(self, name, event=False):
        """Return whether an effect may be named; `event` if a detection has its time."""
        effect = effect_class(name)
        if ModalPattern.SAMPLE_VALUES in effect.patterns:       # read off the samples
            return True
        if self.carried:
            return event
        if self.structural and effect.site is not Site.STRUCTURE:
            return False
        return not (self.repeated and any(p in RANDOM for p in effect.patterns))


def of_carrier(level):
    """Return the Regime of one vibration that goes on, by the level that differs [dB] or 0."""
    words = 'both recordings are one vibration that repeats itself'
    if not level:
        return Regime('', NOWHERE, (f'{words}, of which the forms of modes under random forces '
                                    'do not tell: only events and samples are named',),
                      carried=True)
    return Regime('', Site.EXCITATION.value, (
        f'{words}, and its level differs by {level:+.1f} dB: what rattles does so otherwise at '
        'another level, and no effect but events and samples is concluded',), carried=True)


def of_transients(one, two, lowest_hz):
    """Return the Regime of two strongest Vibrations, None where both go on and are resolved."""
    short = [v for v in (one, two) if unresolved(v, lowest_hz)]
    dying = [v for v in (one, two) if v.dies_away]
    if not short and not dying:
        return None
    if dying:
        why = (f'not stationary: the motion dies away by {dying[0].falls_db:.0f} dB within the '
               f'{"reference" if dying[0] is one else "record"}')
    else:
        needed = min(v.seconds * lowest_hz / v.frequency_hz for v in short)
        why = (f'too short: most of the motion is a vibration at {short[0].frequency_hz:.4g} Hz, '
               f'in the lowest band that {short[0].seconds:.3g} s resolve; about {needed:.2g} s '
               'are needed')
    if not moved(one, two):
        return Regime(why)
    return Regime(
        f'{why}; but the strongest vibration is at {two.frequency_hz:.4g} Hz, in the reference at '
        f'{one.frequency_hz:.4g} Hz, and no force moves it: the structure is another',
        Site.STRUCTURE.value)


def of_drive(evidence, excess):
    """Return the Regime of one signal that repeats itself in both recordings."""
    repeated = (excess.share > LIMITS.distortion.value and excess.repeated > LIMITS.most.value)
    distorted = repeated and excess.outside > LIMITS.most.value
    texts = (evidence.text,) if evidence.structural else ()
    if distorted:
        texts += (f'{100 * excess.share:.2g} % of the power lies outside the lines of the drive, '
                  'on several channels, and repeats itself with them: distortion by the '
                  'structure, not events',)
    structural = evidence.structural or distorted
    return Regime('', Site.STRUCTURE.value * structural, texts, structural, repeated)
