"""Effects at other sizes."""
from dataclasses import replace

import numpy as np

STEPS = 1e-4, 30.0      # smallest and largest factor that a score may put on a starting value


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
