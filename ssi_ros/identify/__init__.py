"""
SSI-COV on sliding windows: from accelerations to tracked modes.

Names are imported when they are first used, so that a node that only counts stamps starts soon.
Functions that are named as their file, `era`, `explain`, `ssi_cov` and `ssi_data`, are there.
"""
from ssi_ros.lazy import first_used

_HOME = {'Identification': 'settings', 'Method': 'methods', 'Monitor': 'monitor',
         'SlidingSsiCov': 'sliding', 'identify': 'monitor', 'pulse_responses': 'okid'}
__all__ = sorted(_HOME)
__getattr__ = first_used(__name__, _HOME)
