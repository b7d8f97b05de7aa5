"""The answer of a diagnosis in sentences: what changed, by how much, how probable it is."""
import math

from ssi_ros.effects import library
from ssi_ros.quantity import probability_text
from ssi_ros.report.parts import percent

PLACES = ('channel', 'array', 'source', 'near')
MOST = 3                # numbers of one kind in a sentence
LEAST_PLACE = 0.05      # probability of another place from which it is said
FIXED = (1e-3, 1e7)     # magnitudes that are written without a power of ten


def headline(found):
    """
    Return the answer in one sentence, with the size of the effect where it is known.

    Parameters
    ----------
    found : dict
        `Diagnosis.to_json()`.

    Returns
    -------
    str
        Without the outcome and without a full stop.

    """
    best = found['candidates'][0] if found['candidates'] else None
    if found['outcome'] not in ('EXPLAINED', 'TIED') or not best['parameters']:
        return found['reason']
    sizes = _sentences(best)
    if not sizes:
        return found['reason']
    sure = f'(probability {probability_text(best["probability"])})'
    share = removed(best)
    what = 'both' if len(best['effects']) > 1 else 'it'
    said = f'{sizes} {sure}; ' + (
        f'correcting {what} {share}' if share else
        'the gap is too small to say how much of it that removes')
    for c in found['candidates'][1:]:
        if c['effects'] == best['effects'] and c['probability'] >= LEAST_PLACE:
            places = _places(c)
            if places and places != _places(best):
                said += (f'. It could also be {_sentences(c) or listed(places)} '
                         f'(probability {probability_text(c["probability"])})')
    others = [n for n in found['verdict']['class'] if n not in best['effects']]
    if found['outcome'] == 'TIED' and others:
        together = probability_text(found['verdict']['probability'])
        said += (f'. The record does not distinguish it from {listed(others)}; the probability '
                 f'of all of them together is {together}')
    return said


def _places(candidate):
    return [p for name in candidate['effects'] for p in quantities(candidate, name)[0]]


def removed(candidate):
    """Return what a candidate removes of the gap, 'removes 98 % of the gap'; '' if unknown."""
    share = candidate['closed']
    if share is None:
        return ''
    if share < 0.005:
        return 'removes none of the gap'
    if share >= 1.005:      # what exceeds all of it is noise
        return 'removes all of the gap'
    return f'removes {percent(share)} of the gap'.replace('> ', 'more than ')


def interval(candidate):
    """Return the 90 % interval of the share that is removed, '92 to 107 %'; '' if unknown."""
    low, high = candidate['closed_low90'], candidate['closed_high90']
    if low is None or high is None:
        return ''
    low, high = min(low, 1.0), min(high, 1.0)       # what exceeds all of it is noise
    return f'{percent(low).removesuffix(" %")} to {percent(high)}' if low < 1.0 else '100 %'


def listed(names):
    """Return names as words, the first four of many."""
    names = list(names)
    if len(names) > 5:
        return ', '.join(names[:4]) + f' and {len(names) - 4} more'
    return ' and '.join(filter(None, (', '.join(names[:-1]), *names[-1:])))


def quantities(candidate, effect):
    """
    Return what the parameters of a candidate say of one of its effects.

    Parameters
    ----------
    candidate : dict
        Of `Diagnosis.to_json()`.
    effect : str
        One of its effects.

    Returns
    -------
    places : list of str
        Such as 'channel e1_a'.
    numbers : list of (str, dict)
        Label without its unit, and the value with its standard deviation, interval and unit.

    """
    places, numbers = [], []
    for key, value in candidate['parameters'].items():
        owner, _, name = key.partition('.')
        if owner != effect:
            continue
        kind, _, place = name.partition('.')
        if place and kind in PLACES:            # without geometry the name holds the place
            places.append(f'{kind} {place}')
        elif isinstance(value['value'], str):
            places.append(f'{name} {value["value"]}')
        else:
            numbers.append((label(name, value['unit']), value))
    return places, numbers


def label(name, unit):
    """Return the name of a quantity in words, without its unit: 'rms' of rms_m_s2."""
    stem, _, at = name.partition('_at_')
    if at.endswith('_mhz'):
        return f'{stem.replace("_", " ")} at {float(at.removesuffix("_mhz")) / 1000:.4g} Hz'
    if unit == '1e-6':
        return 'error' if name == 'ppm' else name.removesuffix('_ppm').replace('_', ' ')
    suffix = unit.lower().replace('1/', 'per_').replace('/', '_').replace(' ', '_')
    return name.removesuffix('_' + suffix.replace('^', '')).replace('_', ' ')


def size_text(value):
    """Return a number with its standard deviation and unit, '1.0205 +- 0.0003'."""
    unit = {'1': '', '1e-6': ' ppm'}.get(value['unit'], f' {value["unit"]}')
    return _rounded(value['value'], value['std']) + unit


def compact(numbers):
    """
    Return labels and texts of numbers, those of many modes as one range.

    Parameters
    ----------
    numbers : list of (str, dict)
        Of `quantities`.

    Returns
    -------
    list of (str, str)
        Such as ('scale', '1.0205 +- 0.0003') or ('scale of 19 modes', '1.003 to 1.05').

    """
    groups, made = {}, []
    for name, value in numbers:
        groups.setdefault(name.partition(' at ')[0], []).append((name, value))
    for stem, members in groups.items():
        if len(members) <= MOST:
            made += [(name, size_text(value)) for name, value in members]
            continue
        values = [value['value'] for _, value in members]
        made.append((f'{stem} of {len(members)} modes',
                     f'{min(values):.4g} to {max(values):.4g}'))
    return made


def _sentences(candidate):
    """Return what `_sentence` says of every effect of a candidate."""
    return ', and '.join(filter(None, (_sentence(candidate, n) for n in candidate['effects'])))


def _sentence(candidate, effect):
    """Return 'array_asymmetry: scale of array E1 is 1.0205 +- 0.0003'; '' without numbers."""
    places, numbers = quantities(candidate, effect)
    cls = library().get(effect)
    size = [n for n in numbers if cls and n[0] == label(cls.size, n[1]['unit'])]
    shown = compact(size or numbers)
    if not shown:
        return ''
    where = f' of {" and ".join(places)}' if places else ''
    where = where.replace(' of near ', ' by a change near ')
    (first, value), *others = shown if len(size or numbers) <= MOST else shown[:1]
    return f'{effect}: {first}{where} is {value}' + ''.join(f', {n} {v}' for n, v in others)


def _rounded(value, std):
    """Return a value rounded to the first digit of its standard deviation."""
    if std is None or not math.isfinite(std) or std <= 0.0:
        return f'{value:.6g}'
    std = float(f'{std:.1g}')
    order = math.floor(math.log10(abs(value) or std))
    place = min(order, math.floor(math.log10(std)))
    if FIXED[0] <= max(abs(value), std) < FIXED[1]:
        digits = max(0, -place)
        return f'{round(value, -place):.{digits}f} +- {std:.{digits}f}'
    return f'{value:.{order - place}e} +- {std:.0e}'
