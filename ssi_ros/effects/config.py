"""
A simulator configuration: a model, and under `effects` what is added to it.

The model is the YAML of a spacecraft, or the `.npz` or `.mat` of somebody else's structure.
"""
from pathlib import Path

from ssi_ros.effects.library import parse_effect
from ssi_ros.model.linear_model import LinearModel
from ssi_ros.model.model_file import is_model_file, load_model, save_model
from ssi_ros.model.spacecraft import packaged, Spacecraft
from ssi_ros.quantity import defaulted, from_mapping, to_mapping
from ssi_ros.whole_file import write_whole


def load_configuration(path=None):
    """
    Read a model and its effects from YAML, `.npz` or `.mat`.

    Parameters
    ----------
    path : str or Path, optional
        File; None reads the packaged spacecraft, which has no effects.

    Returns
    -------
    spacecraft : Spacecraft or LinearModel
        The numbers.
    effects : tuple of Effect
        What the list `effects` names, each as `name:param=value,...`.

    Raises
    ------
    ValueError
        As `load_spacecraft`, or if an effect is not known.

    """
    from ssi_ros.plain_yaml import read_plain
    if is_model_file(path):
        model, effects = load_model(path)
        return model, tuple(parse_effect(e) for e in effects)
    path = packaged('spacecraft.yaml') if path is None else Path(path)
    plain = read_plain(path)
    try:
        effects = plain.pop('effects', []) if isinstance(plain, dict) else []
        if not isinstance(effects, list):
            raise ValueError(f'effects={effects!r} must be a list of name:param=value')
        return (from_mapping(Spacecraft, plain), tuple(parse_effect(str(e)) for e in effects))
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None


def taken_values(path):
    """Return the dotted names of the numbers that a YAML file leaves to the packaged values."""
    from ssi_ros.plain_yaml import read_plain
    if path is None or is_model_file(path):
        return []
    return defaulted(Spacecraft, {k: v for k, v in read_plain(path).items() if k != 'effects'})


def save_configuration(spacecraft, effects, path):
    """Write a configuration that `load_configuration` and `ssi_ros simulate` read back."""
    import yaml
    if isinstance(spacecraft, LinearModel):
        save_model(spacecraft, path, [e.text() for e in effects])
        return
    plain = to_mapping(spacecraft) | {'effects': [e.text() for e in effects]}
    write_whole(path, yaml.safe_dump(plain, sort_keys=False))
