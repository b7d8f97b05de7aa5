"""What would distinguish effects that leave the same record."""
from ssi_ros.effects.base import Site
from ssi_ros.effects.library import effect_class

OWN_ERROR = 'model_error'       # in the class of an effect that the nominal's own error looks like


def separate_by(names):
    """
    Return what would distinguish effects that look the same, a tuple of sentences.

    `names` are of the effects, OWN_ERROR among them where the model may be that wrong; an effect
    that looks the same at two places is there twice. Of less than two nothing is returned.
    """
    if len(names) < 2:
        return ()
    classes = [effect_class(n) for n in names if n != OWN_ERROR]
    sites, words = {c.site for c in classes}, []
    if Site.TIMING in sites:
        words.append('time stamps of an independent clock')
    if Site.EXCITATION in sites:
        words.append('another excitation, such as a slew or a known torque')
    if Site.SENSOR in sites:
        words.append('a sensor moved to another place, or two sensors swapped')
    if OWN_ERROR in names:
        words.append('a healthy recording to calibrate the model on')
    if sum(c.site is Site.STRUCTURE for c in classes) > 1:
        words.append('a longer record, or another level of excitation')
    return tuple(words)
