# Licensed under the Apache License, Version 2.0.
"""The places that an answer names, read from its JSON; the rest of it is read by verify.py."""
import json


def places_named(text):
    """Return {site, sensors, bands, modes, times} of an answer's text; empty for none."""
    try:
        where = json.loads(text).get('where') or {}
        sites = where.get('site') or {}

        def shares(key, *names):
            return tuple(tuple(item[n] for n in (*names, 'share'))
                         for item in where.get(key) or ())

        return {'site': max(sites, key=sites.get) if sites else '',
                'sensors': shares('sensors', 'name'),
                'bands': shares('bands', 'low_hz', 'high_hz'),
                'modes': shares('modes', 'frequency_hz'),
                'times': shares('times', 'start_s', 'end_s')}
    except (ValueError, KeyError, TypeError, AttributeError):      # whatever shape it has
        return {'site': '', 'sensors': (), 'bands': (), 'modes': (), 'times': ()}
