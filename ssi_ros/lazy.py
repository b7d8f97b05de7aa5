"""Names of a package that are imported from its modules when they are first used."""
from importlib import import_module
import sys


def first_used(package, home):
    """
    Return the `__getattr__` of a package by the module that each name is of.

    Raises
    ------
    AttributeError
        By what is returned, if a name is of no module.

    """
    def attribute(name):
        if name not in home:
            raise AttributeError(f'module {package!r} has no attribute {name!r}')
        value = getattr(import_module(f'{package}.{home[name]}'), name)
        setattr(sys.modules[package], name, value)      # so that it is asked for once
        return value
    return attribute
