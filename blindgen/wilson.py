# Licensed under the Apache License, Version 2.0.
"""A share with its 95 % interval."""
from math import sqrt


def wilson(hits, total):
    """Return {value, low95, high95, hits, total}; Wilson 1927, z = 1.96."""
    if not total:
        return {'value': None, 'low95': None, 'high95': None, 'hits': 0, 'total': 0}
    z, p = 1.959964, hits / total
    middle, spread = p + z * z / (2 * total), z * sqrt(p * (1 - p) / total + (z / 2 / total)**2)
    scale = 1 + z * z / total
    return {'value': p, 'low95': max(0.0, (middle - spread) / scale),
            'high95': min(1.0, (middle + spread) / scale), 'hits': int(hits), 'total': int(total)}
