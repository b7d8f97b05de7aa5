"""Effects at other sizes."""
from dataclasses import replace
from itertools import groupby

import numpy as np

STEPS = 1e-4, 30.0      # smallest and largest factor that a score may put on a starting value
FACTORS = (0.3, *(2.0 ** k for k in range(14)))     # of starting values, for sizes far away
FALLS = 3               # likelihoods, each below the one before, that end larger sizes
LARGE = FACTORS[3:]     # of those that no score promises


def at_size(effect, size):
    """Return an effect at the size whose change of the spectrum is `size` times its own."""
    share = float(np.clip(abs(size), *STEPS)) ** (1.0 / effect.power)
    values = {}
    for f in effect.numbers():
        null, value = f.default, getattr(effect, f.name)
        if f.name not in (effect.size, *effect.together):
            continue
        if np.isfinite(null):
            value = null + np.copysign(share, size or 1.0) * (value - null)
        else:
            value = value * share
        values[f.name] = min(max(value, f.metadata['low']), f.metadata['high'])
    return replace(effect, **values)


def change_of(effect):
    """Return the size of an effect less that of none; infinite of a stiffness."""
    return getattr(effect, effect.size) - effect.size_quantity().default


def until_worse(effects, likelihood):
    """Yield likelihoods and effects, growing ones of each sign, until they only explain less."""
    for _, upwards in groupby(effects, lambda e: change_of(e) > 0):
        before = [-np.inf]
        for e in upwards:
            before.append(likelihood(e))
            yield before[-1], e
            if len(before) > FALLS and before[-FALLS:] == sorted(before[-FALLS:], reverse=True):
                break


def brackets(effect, start=None, factors=FACTORS):
    """Return an effect at sizes over its declared range, near enough that a fit finds any."""
    # multiples of a starting value, that of its class if none is given
    f = effect.size_quantity()
    if not effect.spectral:
        return []
    if np.isfinite(f.default):
        start = start or max((abs(v - f.default) for v in effect.starts[f.name]), default=0.0)
        signs = (1.0,) if effect.one_sided() else (-1.0, 1.0)
        values = [f.default + s * start * k for s in signs for k in factors if start]
    else:       # the less, the more it changes, as a stiffness or a corner
        values = [getattr(effect, f.name) / k for k in factors]
    return [replace(effect, **{f.name: v}) for v in values
            if f.metadata['low'] <= v <= f.metadata['high']]
