"""Pictures and tables of a gap: shares, maps, candidates, before and after."""
import numpy as np

from ssi_ros.quantity import fixed, probability_text, with_spread
from ssi_ros.report.curves import banded
from ssi_ros.report.parts import percent, Picture, Table
from ssi_ros.report.style import bars, heat

BANDS = 60              # of a map over frequency
LIMIT = 6.0             # standard deviations at which the colours of a map end
MARKED = 3.0            # standard deviations from which a field of a map is marked + or −
MOST = 8                # bars of a list
EVEN = 2.0              # times the mean: below it shares of times point at nothing
MAP_PX = 620            # least width of a map whose marks can be read


def shares(entries, names, name, title, caption):
    """Draw shares of the gap as bars, or None where there are none."""
    entries = list(zip(entries, names))
    if not entries or not any(e['share'] for e, _ in entries):
        return None
    values = [e['share'] or 0.0 for e, _ in entries]
    return Picture(name, bars([n for _, n in entries], values, map(percent, values), title,
                              limit=max(values)), caption, half=True)


def where_pictures(where):
    """Draw the shares of sites, sensors, bands, modes and times, of `to_json()['where']`."""
    site = [{'share': v} for v in where['site'].values()]
    modes = sorted(where['modes'], key=lambda m: -(m['share'] or 0.0))[:MOST]
    made = [
        shares(site, list(where['site']), 'site', 'Share by site',
               'Where the likely causes act.'),
        shares(where['sensors'], [s['name'] for s in where['sensors']], 'sensors',
               'Share by sensor', 'A channel that alone disagrees points at itself or its array.'),
        shares(where['bands'],
               [f'{b["low_hz"]:.3g} to {b["high_hz"]:.3g} Hz' for b in where['bands']],
               'bands', 'Share by frequency band',
               'Which part of the spectrum disagrees.'),
        shares(modes, [f'{m["frequency_hz"]:.3f} Hz {m["name"]}' for m in modes], 'modes',
               'Share by mode',
               'Modes closer than the resolution share what is between them, so the shares can '
               'add up to more than 100 %.'),
        shares(where['times'],
               [f'{t["start_s"]:.0f} to {t["end_s"]:.0f} s' for t in where['times']],
               'times', 'Share by time',
               'A share that stands out is an event.')]
    largest = max((t['share'] or 0.0 for t in where['times']), default=0.0)
    if len(where['times']) > 2 and largest * len(where['times']) < EVEN:
        made.pop()                      # ten equal bars say no more than their table
    return tuple(p for p in made if p)


def maps(view):
    """Draw the gap over frequency and sensor, and over frequency and time, before and after."""
    made = []
    for when, curves in (('before', view.before), ('after', view.after)):
        if curves is None:
            continue
        words = f'the {view.nominal}' if when == 'before' else f'the {view.better}'
        made += [_sensor_map(view, curves, when, words), _time_map(view, curves, when, words)]
    return tuple(made)


def _bands(view):
    count = min(BANDS, len(view.frame.frequencies_hz))
    return count, [round(float(f), 3) for f in banded(view.frame.frequencies_hz, count, 0)]


def _sensor_map(view, curves, when, words):
    count, f = _bands(view)
    bins = len(view.frame.frequencies_hz) / count
    # a mean of n exponential variables has the standard deviation 1 / sqrt n
    std = view.blur * np.sqrt(view.frame.inflation / (bins * view.frame.segments))
    z = (banded(curves.own, count, 0) - 1.0).T / std
    return Picture(f'map_sensor_{when}', heat(
        np.round(z, 2).astype(np.float32), f, view.channels, f'Sensors over frequency: {words}',
        x_title='frequency [Hz]', unit='sd', limit=LIMIT, texts=_marks(z)),
        'Recorded power over the expected one, in standard deviations of chance: + (purple) is '
        f'too much, − (orange) too little, marked beyond {MARKED:g}. A right model leaves a field '
        'without a pattern.', least_px=MAP_PX)


def _marks(z):
    """Return + or − where a field stands out: both ends of the scale of colours are dark."""
    return np.where(z > MARKED, '+', np.where(z < -MARKED, '−', '')).tolist()


def _time_map(view, curves, when, words):
    count, f = _bands(view)
    bins = len(view.frame.frequencies_hz) / count
    std = np.sqrt(view.frame.inflation / (bins * len(view.channels)))
    z = (banded(curves.whitened, count, 1) - 1.0) / std
    return Picture(f'map_time_{when}', heat(
        np.round(z, 2).astype(np.float32), f,
        [f'{begin:.0f} s' for begin in view.frame.begins_s], f'Time over frequency: {words}',
        x_title='frequency [Hz]', unit='sd', limit=LIMIT, texts=_marks(z)),
        'The same over the segments of the record, all channels whitened together: a column is a '
        'lasting difference, a row an event.', least_px=MAP_PX)


def candidate_name(candidate):
    """Return the names of a candidate's effects as one text."""
    return ' + '.join(candidate['effects'])


def _distinct(names):
    """Return names with a number where one comes again: bars of one name would be one bar."""
    return [n if n not in names[:i] else f'{n} ({names[:i].count(n) + 1})'
            for i, n in enumerate(names)]


def candidate_pictures(candidates):
    """Draw the probability of every candidate, and the share of the gap that it removes."""
    names = _distinct([candidate_name(c) for c in candidates])
    probability = [c['probability'] or 0.0 for c in candidates]
    made = [Picture('probability', bars(names, probability, map(probability_text, probability),
                                        'Probability', ticks='.1f'),
                    'All candidates, with “unknown” and “none”, add up to 1.', half=True)]
    tried = [c for c in candidates if c['closed'] is not None and c['effects'][0] not in
             ('unknown', 'none')]
    if tried:
        def of(key):
            return [c[key] if c[key] is not None else c['closed'] for c in tried]
        made.append(Picture('closed', bars(
            _distinct([candidate_name(c) for c in tried]), of('closed'),
            map(percent, of('closed')),
            'Share of the gap that is removed', low=of('closed_low90'), high=of('closed_high90')),
            'Measured on segments that the fit did not use, with the 90 % interval: at 100 % the '
            'residual gap is at its floor, what exceeds it is noise. A wrong effect stays far '
            'below.', half=True))
    return tuple(made)


def before_after_tables(view):
    """Return frequency, damping, shape and rms of record and models, in user units."""
    rows, recorded = [], view.nominal == 'reference'
    for i, m in enumerate(view.window.modes):
        before = view.pairs_before[i]
        if before is None:
            continue
        row = [with_spread(m.frequency_hz, m.frequency_std_hz, 4, '±'),
               *_against(m, before, recorded)]
        if view.pairs_after is not None:
            after = view.pairs_after[i]
            row += ['-'] * 3 if after is None else _against(m, after)[1:]
        rows.append(tuple(row))
    heads = ['now [Hz]' if recorded else 'identified [Hz]', f'{view.nominal} [Hz]',
             *(('change [%]', 'change of damping [%]') if recorded else
               ('error [%]', 'error of damping [%]')), 'MAC']
    levels = ['channel', 'recorded', view.nominal]
    if view.after is not None:
        heads += [f'error of the {view.better} [%]', 'of damping [%]', 'MAC']
        levels.append(view.better)
    power = [(name, *(f'{1e3 * r[i]:#.4g}' for r in view.rms))
             for i, name in enumerate(view.channels)]
    return (Table(tuple(heads), tuple(rows),
                  ('Change: this record less the reference, over the reference. ' if recorded
                   else 'Error: the model less what was identified, over what was identified. ')
                  + 'MAC: modal assurance criterion of the two shapes, 1 = the same'),
            Table(tuple(levels), tuple(power),
                  'Rms of each channel in the band used [mm/s²], levels fitted'))


def _against(mode, pair, recorded=False):
    """Return frequency, errors of a model or changes since a reference, and MAC, as texts."""
    sign = -1 if recorded else 1            # a change is counted from what was before
    return [f'{pair.frequency_hz:.4f}',
            fixed(100 * ((pair.frequency_hz / mode.frequency_hz) ** sign - 1), 3, '+'),
            fixed(100 * ((pair.damping_ratio / mode.damping_ratio) ** sign - 1), 0, '+'),
            f'{pair.mac:.3f}']
