"""A diagnosis as sections, in the order of an engineer's questions."""
from ssi_ros.report.gap_pictures import (before_after_tables, candidate_name, candidate_pictures,
                                         maps, where_pictures)
from ssi_ros.report.parts import measured, number, percent, Section, Table
from ssi_ros.report.record_pictures import spectra

OUTCOMES = {
    'WITHIN_FLOOR': 'No gap',
    'EXPLAINED': 'There is a gap, and it is explained',
    'TIED': 'There is a gap, and several effects explain it equally well',
    'UNEXPLAINED': 'There is a gap that no effect of the library explains',
    'TOO_LITTLE_DATA': 'The record cannot answer'}
OPEN = ('unknown', 'none')
MEANING = {'unknown': 'something that is not in the library',
           'none': 'no effect at all: the gap is chance'}


def summary(found):
    """Return the answer in one sentence; `found` is the JSON of a Diagnosis."""
    return f'{found["outcome"]}. {OUTCOMES.get(found["outcome"], "")}: {found["reason"]}.'


def diagnosis_sections(found, view=None, *, places=None, bag='BAG', nominal='--model MODEL.yaml'):
    """
    Return the sections of a diagnosis.

    Parameters
    ----------
    found : dict
        `Diagnosis.to_json()`; lists may be empty and numbers None, as with a reference record.
    view : GapView, optional
        Curves to draw; without it words, tables and bars remain.
    places : sequence of str, optional
        For every candidate the words of its effects, such as 'channel e1_a'.
    bag, nominal : str
        For the commands of the last section; `nominal` is '--model FILE' or '--reference BAG'.

    Returns
    -------
    tuple of Section

    """
    candidates = [c for c in found['candidates'] if c['effects'] and not (
        c['effects'][0] == 'none' and (c['probability'] or 0.0) < 1e-3)]
    places = list(places or []) + [''] * len(found['candidates'])
    quiet = found['outcome'] in ('WITHIN_FLOOR', 'TOO_LITTLE_DATA')
    made = [_is_there(found)]
    if found['outcome'] != 'TOO_LITTLE_DATA':
        made.append(_where(found, view, quiet))
    if not quiet:
        made += [_which(found, candidates, places), _how_sure(found, candidates),
                 _what_else(found, candidates)]
    if found['outcome'] != 'TOO_LITTLE_DATA':
        made.append(_how_far(found, candidates, view, quiet))
    made.append(_next(found, bag, nominal))
    return tuple(made)


def places_of(diagnosis):
    """Return the words of every candidate's effects: channel, array, source."""
    return [', '.join(f'{k} {getattr(e, k)}' for e in getattr(c, 'built', ())
                      for k in ('channel', 'array', 'source')
                      if isinstance(getattr(e, k, None), str))
            for c in diagnosis.candidates]


def _is_there(found):
    gap = found['gap']
    lines = [OUTCOMES.get(found['outcome'], found['outcome']) + ': ' + found['reason'] + '.']
    if found.get('signs'):
        lines.append('Signs, seen before any fit; a mode that has moved can look like a line: '
                     + '; '.join(found['signs']) + '.')
    if gap.get('before') is None:
        return Section('Is there a gap?', tuple(lines))
    above = (gap['before'] - gap['floor']) / gap['floor_std'] if gap.get('floor_std') else None
    table = Table(('gap [nats a band]', 'floor of a right model', 'above it', 'chance of this'),
                  ((number(gap['before'], 4),
                    f'{number(gap["floor"], 4)} ± {number(gap["floor_std"], 2)}',
                    f'{number(above)} sd', _chance(gap.get('p_value'))),))
    return Section('Is there a gap?', tuple(lines), (table,))


def _chance(p):
    return 'below 1e-15' if p is not None and p < 1e-15 else number(p, 2)


def _where(found, view, quiet):
    lines = ('Shares of what is above the floor; chance alone has shares too, so read them with '
             'the answer above.',) if quiet else ()
    pictures, tables = where_pictures(found['where']), (_leading(found['where']),)
    if view is not None:
        pictures += tuple(p for p in maps(view) if p.name.endswith('before'))
    if not pictures:
        lines += ('Nothing is above the floor anywhere.',)
    return Section('Where is it?', lines, tables if tables[0].rows else (), pictures)


def _leading(where):
    """Return the largest shares of each kind as a table, for readers of words."""
    names = {'sensors': lambda e: e['name'],
             'bands': lambda e: f'{e["low_hz"]:.3g} to {e["high_hz"]:.3g} Hz',
             'modes': lambda e: f'{e["frequency_hz"]:.3f} Hz {e["name"]}',
             'times': lambda e: f'{e["start_s"]:.0f} to {e["end_s"]:.0f} s'}
    rows = [('site', *_best([(v, k) for k, v in where['site'].items()]))]
    rows += [(kind, *_best([(e['share'], name(e)) for e in where[kind]]))
             for kind, name in names.items()]
    return Table(('by', 'most', 'second', 'third'), tuple(r for r in rows if r[1]))


def _best(shares):
    best = sorted(((s, n) for s, n in shares if s), reverse=True)[:3]
    return [f'{n}: {percent(s)}' for s, n in best] + [''] * (3 - len(best))


def _which(found, candidates, places):
    verdict = found['verdict']
    named = ' + '.join(verdict['effects']) or 'none of the library'
    lines = (f'Best: {named}, with probability {percent(verdict["probability"], 1)}.',)
    rows = []
    for c, place in zip(candidates, places):
        values = ', '.join(f'{k.split(".")[-1]} {measured(v["value"], v["unit"])}'
                           for k, v in _numbers(c))
        rows.append((candidate_name(c), percent(c['probability'], 1),
                     '; '.join(filter(None, (place, values))) or MEANING.get(c['effects'][0], ''),
                     f'{percent(c["closed"])} ({percent(c["closed_low90"])} to '
                     f'{percent(c["closed_high90"])})' if c['effects'][0] not in OPEN else '-',
                     ('yes' if c['inside_floor'] else 'no') if c['effects'][0] not in OPEN
                     else '-'))
    heads = ('candidate', 'probability', 'at', 'closes (90 % interval)',
             'gap then inside its floor')
    table = Table(heads, tuple(rows), 'Best first')
    return Section('Which effect is it?', lines, (table,), candidate_pictures(candidates))


def _numbers(candidate):
    """Return the parameters that are numbers; channels and arrays are told as places."""
    return [(k, v) for k, v in candidate['parameters'].items() if not isinstance(v['value'], str)]


def _how_sure(found, candidates):
    verdict, best = found['verdict'], candidates[0] if candidates else None
    lines = [f'Probability {percent(verdict["probability"], 1)} for '
             + (' or '.join(verdict['class']) or 'no effect of the library') + '.']
    rows = [(k, measured(v['value'], v['unit'], 6), number(v['std'], 2),
             f'{number(v["low90"], 6)} to {number(v["high90"], 6)}')
            for k, v in (_numbers(best) if best else ())]
    table = Table(('parameter', 'value', '± 1 sd', '90 % interval'), tuple(rows))
    return Section('How sure is that?', tuple(lines), (table,) if rows else ())


def _what_else(found, candidates):
    alike = [n for n in found['verdict']['class'] if n not in found['verdict']['effects']]
    lines = []
    if alike:
        lines.append('This record cannot tell it from: ' + ', '.join(alike) + '.')
    rest = [c for c in candidates[1:] if (c['probability'] or 0.0) >= 5e-4]
    for c in rest:
        lines.append(f'{candidate_name(c)}: {percent(c["probability"], 1)}'
                     + (f' ({MEANING[c["effects"][0]]})' if c['effects'][0] in MEANING else '')
                     + '.')
    if not lines:
        lines.append('Nothing else of the library has a probability of 0.05 % or more.')
    if found['separate_by']:
        lines.append('What would part them: ' + '; '.join(found['separate_by']) + '.')
    return Section('What else could it be?', tuple(lines))


def _how_far(found, candidates, view, quiet):
    lines, tables, pictures = [], (), ()
    best = candidates[0] if candidates else None
    if quiet or best is None or best['effects'][0] in OPEN:
        lines.append('No effect is to be put in; the curves show record and model.')
    else:
        lines.append(
            f'With {candidate_name(best)} in the simulator {percent(best["closed"])} of the gap '
            f'is gone ({percent(best["closed_low90"])} to {percent(best["closed_high90"])}, 90 % '
            'interval), measured on data that the fit did not see; what is left is '
            + ('inside' if best['inside_floor'] else 'still above') + ' the floor.')
        controls = [(('no effect at all' if c['effects'] == ['none'] else
                      f'one drawn at random ({candidate_name(c)})'), percent(c['closed']))
                    for c in found.get('controls', ()) if c['closed'] is not None]
        if controls:
            lines.append('For comparison, tried in the same way: ' + '; '.join(
                f'{name} closes {share}' for name, share in controls) + '.')
    if view is not None:
        after = view.after.expected if view.after is not None else None
        pictures = (spectra(view.channels, view.frame, view.record, view.before.expected, after,
                            'gap_spectra', view.nominal),
                    *(p for p in maps(view) if p.name.endswith('after')))
        tables = before_after_tables(view)
    return Section('How far does it shrink?', tuple(lines), tables, pictures)


def _next(found, bag, nominal):
    outcome, model = found['outcome'], not nominal.startswith('--reference')
    apply = f'ssi_ros diagnose {bag} {nominal} --apply corrected.yaml'
    commands = (apply,) if model else ()
    seen = f'ssi_ros identifiability {nominal}'
    if outcome == 'WITHIN_FLOOR':
        lines = ('Nothing has to be done.',)
        if model:
            lines += ('What this record could have shown, and what not:',)
            commands = (seen,)
    elif outcome == 'EXPLAINED' and model:
        lines = ('Put the effect into the simulator and see that the gap is gone:',)
        commands = (apply, f'ssi_ros diagnose {bag} --model corrected.yaml')
    elif outcome == 'EXPLAINED':
        lines = ('Look for the cause where the gap lies. With a model in place of a reference '
                 'the effect could be put into the simulator and tried:',)
        commands = (f'ssi_ros diagnose {bag} --model MODEL.yaml',)
    elif outcome == 'TIED':
        lines = ('Do not choose by taste: all of them would leave the same record. To part them: '
                 + ('; '.join(found['separate_by']) or 'a longer record') + '.',)
        if model:
            lines += ('Any of them may stand in the simulator meanwhile:',)
    elif outcome == 'UNEXPLAINED':
        lines = ('Take the nearest effect as a hint, not as an answer: look at the maps above '
                 'for where the rest lies. If you know a mechanism that the library lacks, add '
                 'it: one small file, see “Add an effect” in the documentation.',)
        commands = ('ssi_ros effects',)
    else:
        lines = (found['reason'] + '. Record longer'
                 + (', and ask beforehand what a length shows:' if model else '.'),)
        commands = (f'{seen} --duration-s 600',) if model else ()
    return Section('What to do next?', lines, (), (), commands)
