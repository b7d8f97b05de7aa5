"""
SSI-COV on sliding windows: from accelerations to tracked modes.

Names are imported when they are first used, so that a node that only counts stamps starts soon.
Functions that are named as their file, `era`, `explain`, `ssi_cov` and `ssi_data`, are there.
"""
from importlib import import_module

_HOME = {'Identification': 'settings', 'Method': 'methods', 'Monitor': 'monitor',
         'SlidingSsiCov': 'sliding', 'identify': 'monitor', 'pulse_responses': 'okid'}
__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'{__name__}.{_HOME[name]}'), name)
    globals()[name] = value
    return value
