"""
Functions of SciPy that are imported when they are first called.

`scipy.optimize` and `scipy.ndimage` take an eighth of the start of a diagnosis to import, and a
record without a gap calls nothing of them.
"""
from functools import lru_cache
from importlib import import_module


def _later(module, name):
    """Return a function that imports another one, of a module of SciPy, when it is called."""
    @lru_cache(maxsize=1)
    def found():
        return getattr(import_module(f'scipy.{module}'), name)

    def called(*args, **options):
        return found()(*args, **options)
    return called


maximum_filter1d = _later('ndimage', 'maximum_filter1d')
median_filter = _later('ndimage', 'median_filter')
uniform_filter1d = _later('ndimage', 'uniform_filter1d')
brentq = _later('optimize', 'brentq')
linear_sum_assignment = _later('optimize', 'linear_sum_assignment')
minimize = _later('optimize', 'minimize')
minimize_scalar = _later('optimize', 'minimize_scalar')
nnls = _later('optimize', 'nnls')
