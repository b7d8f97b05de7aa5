# Licensed under the Apache License, Version 2.0.
"""
Judge whether the place that an answer names first holds what the effect changed.

Sensor and side: the channel or the array of the named effect if it has one, else the sensor with
the largest share. Mode, band and time: right when the place named first truly holds at least half
of what the best of the named places holds. Chance is the share of places that would do.
"""
ENOUGH = 0.3                # of all that changes lies at modes, or there is no mode to name
UNEVEN = 2.0                # times an even share, or there is no time to name
KINDS = ('site', 'sensor', 'side', 'mode', 'band', 'time')


def places(true, values, said, duration_s):
    """
    Return {place: (right, chance)} for the places that a case has and an answer names.

    Parameters
    ----------
    true : dict
        `where` of the label's effect.
    values : dict
        'effect.parameter' of the answer's first candidate.
    said : dict
        Of `places_named`.
    duration_s : float
        Of the record [s].

    """
    data = {}
    named = {key.split('.')[-1]: v for key, v in values.items() if isinstance(v, str)}
    top = max(said['sensors'], key=lambda s: s[1])[0] if said['sensors'] else ''
    sensor = named.get('channel', top)
    side = named.get('array', sensor[:2].upper())
    if true['channels'] and sensor:
        data['sensor'] = (sensor in true['channels'], 1 / 4)
    if true['arrays'] and side:
        data['side'] = (side in true['arrays'], 1 / 2)
    if said['site']:
        data['site'] = (said['site'] == true['site'], 1 / 4)
    if sum(share for _, share in true['modes']) >= ENOUGH and said['modes']:
        held = [min(true['modes'], key=lambda m: abs(m[0] - f))[1] for f, _ in said['modes']]
        data['mode'] = _first(held, said['modes'])
    if true['bands'] and said['bands']:
        top = true['half_rate_hz']
        data['band'] = _first([_held(true['bands'], low / top, high / top)
                               for low, high, _ in said['bands']], said['bands'])
    if true['times'] and max(true['times']) * len(true['times']) >= UNEVEN and said['times']:
        data['time'] = _first([_held(true['times'], begin / duration_s, end / duration_s)
                               for begin, end, _ in said['times']], said['times'])
    return data


def _first(held, items):
    """Return whether the item with the largest share named holds half of the best, and chance."""
    enough = [h >= max(held) / 2 and h > 0 for h in held]
    return enough[max(range(len(items)), key=lambda k: items[k][-1])], sum(enough) / len(enough)


def _held(shares, begin, end):
    """Return what lies between two points of 0 to 1 of shares over equal parts."""
    n = len(shares)
    return sum(v * max(0.0, min(end * n, k + 1) - max(begin * n, k)) for k, v in enumerate(shares))
