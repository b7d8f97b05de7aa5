"""Find effects by name: those in this folder, and those of third parties' entry points."""
from functools import lru_cache
from importlib import import_module
from importlib.metadata import entry_points
import pkgutil

from ssi_ros.effects import base
from ssi_ros.quantity import quantities, unknown

ENTRY_POINTS = 'ssi_ros.effects'


def library():
    """
    Return every effect class by name, in the order of site and name.

    A package adds effects with an entry point in the group `ssi_ros.effects` that names a module
    or a class; loading it runs `@effect`.
    """
    _load()
    sites = list(base.Site)
    return dict(sorted(base.known().items(), key=lambda e: (sites.index(e[1].site), e[0])))


@lru_cache(maxsize=1)
def _load():
    """Import this folder and the entry points: what `@effect` marks there is an effect."""
    package = import_module('ssi_ros.effects')
    for module in pkgutil.iter_modules(package.__path__):
        import_module(f'ssi_ros.effects.{module.name}')
    for point in entry_points(group=ENTRY_POINTS):
        point.load()


def effect_class(name):
    """Return the class of an effect, ValueError with the near names if there is none."""
    if name in base.known():
        return base.known()[name]
    effects = library()
    if name not in effects:
        raise ValueError(unknown(f'effect {name!r}', name, effects))
    return effects[name]


def with_laws(classes):
    """Return classes of effects, and those that are other laws of them."""
    classes = tuple(classes)
    names = {cls.name for cls in classes}
    return (*classes, *(cls for n, cls in library().items() if cls.law_of in names
                        and n not in names))


def parse_effect(text):
    """
    Read an effect from `name:param=value,...`, the form of the command line.

    Raises
    ------
    ValueError
        For a name or a parameter that is not known (the near ones are listed), or a value that
        is not a number or out of range.

    """
    name, _, rest = text.partition(':')
    cls = effect_class(name.strip())
    declared = {f.name: f for f in quantities(cls)}
    values = {}
    for pair in filter(None, (p.strip() for p in rest.split(','))):
        key, equals, value = (p.strip() for p in pair.partition('='))
        if key not in declared:
            raise ValueError(unknown(f'{name}:{key}', key, declared))
        if not equals:
            raise ValueError(f'{name}:{key} has no value; write {key}=...')
        if not isinstance(declared[key].default, str):
            try:
                value = float(value)
            except ValueError:
                raise ValueError(f'{name}:{key}={value!r} must be a number '
                                 f'[{declared[key].metadata["unit"]}]') from None
        values[key] = value
    return cls(**values)
