"""A simulator configuration: the YAML of a spacecraft, and under `effects` what is added to it."""
from pathlib import Path

from ssi_ros.effects.library import parse_effect
from ssi_ros.model.spacecraft import packaged, Spacecraft
from ssi_ros.quantity import from_mapping, to_mapping


def load_configuration(path=None):
    """
    Read a spacecraft and its effects from YAML.

    Parameters
    ----------
    path : str or Path, optional
        File; None reads the packaged spacecraft, which has no effects.

    Returns
    -------
    spacecraft : Spacecraft
        The numbers.
    effects : tuple of Effect
        What the list `effects` names, each as `name:param=value,...`.

    Raises
    ------
    ValueError
        As `load_spacecraft`, or if an effect is not known.

    """
    import yaml
    path = packaged('spacecraft.yaml') if path is None else Path(path)
    try:
        plain = yaml.safe_load(path.read_text())
        effects = plain.pop('effects', []) if isinstance(plain, dict) else []
        if not isinstance(effects, list):
            raise ValueError(f'effects={effects!r} must be a list of name:param=value')
        return (from_mapping(Spacecraft, plain), tuple(parse_effect(str(e)) for e in effects))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f'{path} is not YAML: {error}') from None
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None


def save_configuration(spacecraft, effects, path):
    """Write a configuration that `load_configuration` and `ssi_ros simulate` read back."""
    import yaml
    plain = to_mapping(spacecraft) | {'effects': [e.text() for e in effects]}
    Path(path).write_text(yaml.safe_dump(plain, sort_keys=False))
