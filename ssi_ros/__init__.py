"""Watch a flexible spacecraft on orbit: simulate, identify, log, replay, diagnose."""

__version__ = '0.1.0'
