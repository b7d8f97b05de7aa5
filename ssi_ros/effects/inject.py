"""Put effects into a spacecraft: numbers -> setup, eq. (80) of docs/theory-gap.md."""
from ssi_ros.effects.base import Setup
from ssi_ros.effects.places import check_needs
from ssi_ros.model.structure import assemble


def inject(spacecraft, effects=(), duration_s=600.0):
    """
    Build the setup of a spacecraft with effects in it.

    All effects first change the numbers, then the system is assembled once, then they change the
    setup in the order given; an effect at its null value is skipped.

    Parameters
    ----------
    spacecraft : Spacecraft or LinearModel
        The nominal numbers.
    effects : sequence of Effect
        None gives the nominal setup.
    duration_s : float
        Length of the record that drifts and sweeps stretch over [s].

    Returns
    -------
    Setup

    Raises
    ------
    ValueError
        If an effect names a channel or an array that is not there, or cannot act on it, or needs
        what a LinearModel does not have, or two set the hinge of one array.

    """
    effects = tuple(e for e in effects if not e.is_null)
    check_needs(spacecraft, map(type, effects))
    hinged = {}
    for e in effects:
        if e.hinge and hinged.setdefault(e.array, e) is not e:
            raise ValueError(f'{hinged[e.array].name} and {e.name} both set the hinge of '
                             f'{e.array}; give one of them, with the stiffness of that hinge')
        spacecraft = e.spacecraft(spacecraft)
    system = assemble(spacecraft, hinge_inputs=any(e.nonlinear and e.hinge for e in effects))
    setup = Setup(spacecraft, system, system.rate_hz, duration_s)
    for e in effects:
        setup = e.apply(setup)
    return setup
