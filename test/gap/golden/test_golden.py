"""Golden diagnoses: the answers of cases.py are those of the JSON files beside this test."""
import json
import math

from cases import CASES, path_of
import pytest

SLOW = ('model_array_asymmetry', 'model_clipping_and_missing', 'model_harmonic_disturbance',
        'model_hinge_friction', 'model_impulsive_events', 'model_pair', 'model_unknown')
PROBABILITY = 0.05      # abs: another optimiser path moves log odds by some 0.1, no more
GAP = 1e-3              # rel: round-off of another order of sums is far below
LOG10_P = 0.3           # abs: a factor of 2, as of one more or one less test in a p-value
OF_STD = 0.2            # a value may stop at another point of a flat optimum: 0.2 of its std
EXACT = 1e-3            # rel: values that are read off the samples and so have no std
STD = 0.05              # rel: curvature at that other point
CLOSED = 0.01           # abs: share of the gap that goes, follows the values
INTERVAL = 0.05         # abs: its ends, by a ratio of two uncertain numbers
SHARE = 0.02            # abs: shares of sensors, bands and modes follow the probability


def number(name, pinned, found, tolerance):
    """Yield the difference of two numbers beyond a tolerance; None is equal to None alone."""
    if pinned is None or found is None:
        if pinned is not found:
            yield f'{name}: {pinned} pinned, {found} found'
    elif not abs(found - pinned) <= tolerance:
        yield f'{name}: {pinned:.6g} pinned, {found:.6g} found, {tolerance:.2g} allowed'


def word(name, pinned, found):
    """Yield the difference of two words, or lists of words."""
    if pinned != found:
        yield f'{name}: {pinned} pinned, {found} found'


def parameters(name, pinned, found):
    """Yield the differences of the parameters of a candidate."""
    yield from word(f'{name} parameters', sorted(pinned), sorted(found))
    for key in sorted(set(pinned) & set(found)):
        one, two = pinned[key], found[key]
        if isinstance(one['value'], str) or isinstance(two['value'], str):
            yield from word(f'{name} {key}', one['value'], two['value'])
            continue
        allowed = (EXACT * abs(one['value'] or 0.0) if one['std'] is None
                   else OF_STD * one['std'])
        yield from number(f'{name} {key}', one['value'], two['value'], allowed)
        yield from number(f'{name} std of {key}', one['std'], two['std'],
                          STD * (one['std'] or 0.0))


def differences(pinned, found):
    """Yield all differences of two summaries in words."""
    for key in ('outcome', 'effects', 'class', 'detections'):
        yield from word(key, pinned[key], found[key])
    yield from number('probability', pinned['probability'], found['probability'], PROBABILITY)
    for key, value in pinned['gap'].items():
        allowed = LOG10_P if key == 'log10_p' else GAP * abs(value or 0.0)
        yield from number(f'gap {key}', value, found['gap'][key], allowed)
    for key, value in pinned['closed'].items():
        yield from number(f'closed {key}', value, found['closed'][key],
                          CLOSED if key == 'share' else INTERVAL)
    for key, one in pinned['strongest'].items():
        two = found['strongest'][key]
        yield from word(f'strongest {key}', one and one['name'], two and two['name'])
        if one and two:
            yield from number(f'share of the strongest {key}', one['share'], two['share'], SHARE)
    names = [[c['effects'] for c in side['candidates']] for side in (pinned, found)]
    yield from word('candidates', *names)
    for k, (one, two) in enumerate(zip(pinned['candidates'], found['candidates'])):
        if one['effects'] == two['effects']:
            yield from parameters(f'candidate {k + 1}', one['parameters'], two['parameters'])


@pytest.mark.parametrize('name', [pytest.param(n, marks=[pytest.mark.slow] * (n in SLOW))
                                  for n in CASES])
def test_the_diagnosis_is_the_pinned_one(name):
    """Outcome, verdict, gap, candidates with parameters, localisation, number of detections."""
    pinned = json.loads(path_of(name).read_text())
    assert pinned['description'] == CASES[name].description
    found = list(differences(pinned, CASES[name].answer()))
    if found:
        pytest.fail('\n  '.join([f'{name}: {len(found)} differences', *found]), pytrace=False)


def test_no_golden_file_is_without_its_case():
    """A case that is renamed leaves no file that is compared with nothing."""
    files = {p.stem for p in path_of('any').parent.glob('*.json')}
    assert files == set(CASES)


def test_a_difference_is_found_in_every_number():
    """Each number of a summary moved on its own, beyond its tolerance, is one difference."""
    pinned = json.loads(path_of('model_sensor_gain').read_text())
    assert list(differences(pinned, pinned)) == []
    places = list(numbers(pinned))
    assert len(places) > 10
    for place in places:
        changed = json.loads(json.dumps(pinned))
        *way, last = place
        inside = changed
        for key in way:
            inside = inside[key]
        inside[last] += 1.0 + abs(inside[last])
        assert len(list(differences(pinned, changed))) == 1, place


def numbers(value, place=()):
    """Yield the place of every finite number in nested lists and dicts."""
    entries = (value.items() if isinstance(value, dict)
               else enumerate(value) if isinstance(value, list) else ())
    for key, entry in entries:
        if isinstance(entry, (int, float)) and math.isfinite(entry):
            yield (*place, key)
        yield from numbers(entry, (*place, key))
