"""
What else knows an effect by its name: its detectors, and its forms where there is no geometry.

A file that can detect an effect says so itself, so that a new effect touches one file whatever the
nominal, also in another package: its entry point loads the module, and its decorators run.
"""
from ssi_ros.effects.library import effect_class, library
from ssi_ros.effects.places import applicable

SOURCES = {
    'samples': 'samples',
    'input': 'reconstruction',
    'spectrum': 'simulator, fitted, samples, settings',
    'recordings': 'comparison',
    'periods': 'comparison'}
"""What a detector works on, and its arguments after the class of the effect."""

_DETECTORS = {of: {} for of in SOURCES}
_MODAL_FORMS, _DEFLECTIONS = {}, {}


def detects(effect_name, of='samples'):
    """
    Register a function as the detector of an effect.

    Parameters
    ----------
    effect_name : str
        Name of the effect; it may be declared later.
    of : str
        What the function works on, one of `SOURCES`. It is called with the class of the effect and
        then, for 'samples', the record (Samples); for 'input', the reconstructed input; for
        'spectrum', `simulator, fitted, samples, settings`; for 'recordings' and 'periods', two
        recordings, the latter of periodic excitation.

    Returns
    -------
    callable
        A decorator. The function returns a Detection, or None where there is nothing.

    Raises
    ------
    ValueError
        If `of` is not known, or the effect has another detector of the same.

    """
    if of not in SOURCES:
        raise ValueError(f'of={of!r} must be one of {", ".join(SOURCES)}')
    return _into(_DETECTORS[of], effect_name)


def modal_form(effect_name):
    """
    Register a function that yields the modal forms of an effect, called with a recorded nominal.

    Raises
    ------
    ValueError
        If the effect has other forms already.

    """
    return _into(_MODAL_FORMS, effect_name)


def deflection(effect_name):
    """
    Register a function that predicts how well the detector of an effect would find it.

    It is called with an effect and the `Sensitivity` of a record yet to be made, and returns the
    mean of the detection statistic over its standard deviation, d'.

    Raises
    ------
    ValueError
        If the effect has another already.

    """
    return _into(_DEFLECTIONS, effect_name)


def detectors(of):
    """Return the detectors of one source by effect, in the order of the library."""
    return _in_order(_DETECTORS[of])


def modal_forms():
    """Return the functions that yield modal forms by effect, in the order of the library."""
    return _in_order(_MODAL_FORMS)


def deflections():
    """Return the functions that predict d' by effect, in the order of the library."""
    return _in_order(_DEFLECTIONS)


def showing(pattern):
    """
    Return the names of the effects that show a pattern where there is no geometry.

    Those that declare it first come before the others, each in the order of the library.
    """
    effects = [library()[n] for n in applicable(None) if pattern in library()[n].patterns]
    return tuple(e.name for e in sorted(effects, key=lambda e: e.patterns[0] is not pattern))


def _into(registry, name):
    def register(function):
        there = registry.setdefault(name, function)
        if (there.__module__, there.__qualname__) != (function.__module__, function.__qualname__):
            raise ValueError(f'{name} has two functions of one kind: {there.__qualname__} in '
                             f'{there.__module__} and {function.__qualname__} in '
                             f'{function.__module__}; take one away')
        registry[name] = function
        return function
    return register


def _in_order(registry):
    order = list(library())
    for name in registry:
        effect_class(name)                  # an unknown name is a mistake of its author
    return {name: registry[name] for name in order if name in registry}
