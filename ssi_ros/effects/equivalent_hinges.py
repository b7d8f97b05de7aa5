"""Nonlinear hinges that are, for the motion of a record, the same as a linear one."""
from ssi_ros.effects.registry import effect_class
from ssi_ros.effects.statistical_linearisation import angle_rms
from ssi_ros.quantity import in_range, quantities


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


def extensions(effect, names):
    """Return effects of all quantities of another and more of a small size, and its opposite."""
    # A hinge with play is a hinge: it is as good an answer as long as nothing shows the play.
    shared, found = {f.name for f in quantities(effect)}, [*effect.opposite()]
    for name in names:
        cls = effect_class(name)
        if cls is type(effect) or not cls.nonlinear or not cls.spectral:
            continue
        common = {f.name: getattr(effect, f.name) for f in quantities(cls) if f.name in shared
                  and f.name != cls.size}
        whole = {f.name for f in quantities(cls)} - {cls.size} == set(common) and len(common) > 1
        # a fit may have made a linear hinge as good as none, which no law begins at
        if whole and in_range(cls, common):
            found.append(cls(**common, **{cls.size: min(cls.starts[cls.size])}))
    return found


def beside_linear(effects, fitted):
    """
    Return starts in which laws of a hinge have the stiffness of the linear one.

    `fitted` returns the first fit of an effect, or None.
    """
    linear, found = {}, []
    for e in sorted(effects, key=lambda e: bool(e.hinge and e.nonlinear)):
        if e.hinge and not e.nonlinear:
            linear.setdefault(e.array, fitted(e))
        law = e.hinge and e.nonlinear and linear.get(e.array)
        found += law and extensions(law.candidate.effects[0], (e.name,))[-1:] or [e]
    return list(dict.fromkeys(found))
