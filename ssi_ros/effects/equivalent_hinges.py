"""Nonlinear hinges that are, for the motion of a record, the same as a linear one."""
from ssi_ros.effects.registry import effect_class
from ssi_ros.effects.statistical_linearisation import angle_rms
from ssi_ros.quantity import in_range


def equivalent_hinges(effect, names, setup_of):
    """
    Return laws of a hinge whose equivalent linear hinge it is: a list of effects of every law.

    A fit of a law from where its equivalent stiffness is another one ends beside what it looks
    for, as the stiffness and the size of a law trade against each other.

    Parameters
    ----------
    effect : Effect
        What a fit has found; what is no linear hinge has no such laws.
    names : tuple of str
        The effects that are considered.
    setup_of : callable
        Returns the Setup of an effect at the levels of the record.

    """
    laws = [c for c in map(effect_class, names) if c.hinge and c.nonlinear]
    if not effect.hinge or effect.nonlinear or not laws:
        return []
    # of a small size: the setup has the hinge as an input
    start = laws[0](array=effect.array, stiffness_n_m_rad=effect.stiffness_n_m_rad,
                    **{laws[0].size: min(laws[0].starts[laws[0].size])})
    rms = angle_rms(setup_of(start))
    return [[law(array=effect.array, **values)
             for values in law.like(effect.stiffness_n_m_rad, rms) if in_range(law, values)]
            for law in laws]
