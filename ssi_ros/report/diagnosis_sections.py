"""A diagnosis as sections, in the order of an engineer's questions."""
from ssi_ros.quantity import fixed, p_value_text, probability_text, with_spread
from ssi_ros.report.gap_pictures import (
    before_after_tables, candidate_name, candidate_pictures, EVEN, maps, where_pictures)
from ssi_ros.report.parts import measured, number, percent, Section, Table
from ssi_ros.report.record_pictures import spectra
from ssi_ros.report.wording import compact, headline, interval, listed, quantities, removed
from ssi_ros.report.zoom_pictures import zooms

OUTCOMES = {
    'WITHIN_FLOOR': 'No gap',
    'EXPLAINED': 'There is a gap, and it is explained',
    'TIED': 'There is a gap, and several effects explain it equally well',
    'UNEXPLAINED': 'There is a gap that no effect of the library explains',
    'TOO_LITTLE_DATA': 'The record cannot answer'}
OPEN = ('unknown', 'none')
MEANING = {'unknown': 'what is not in the library, or one more effect, too small to be seen',
           'none': 'no effect at all: the gap is chance'}
SHOWN = 0.005           # probability from which a candidate is named beside the first
MOST = 12               # numbers of an effect that have a row each


def summary(found):
    """Return the answer in one sentence; `found` is the JSON of a Diagnosis."""
    words = OUTCOMES.get(found['outcome'], '')
    # the size of what explains a gap says that there is one
    plain = '' if found['outcome'] == 'EXPLAINED' else f'. {words}'
    return f'{found["outcome"]}{plain}: {headline(found)}{_at_most(found)}.'


def _at_most(found):
    """Return where an unexplained gap lies, and how large it is; '' for other outcomes."""
    gap, where = found['gap'], found['where']
    if found['outcome'] != 'UNEXPLAINED' or not gap.get('floor_std'):
        return ''
    above = number((gap['before'] - gap['floor']) / gap['floor_std'])
    parts = [n for row in _leading(where).rows if row[0] in ('sensors', 'bands')
             for n in row[1:2] if n]
    return (f'. The gap is {above} standard deviations above its floor'
            + (f', the largest shares at {" and at ".join(parts)}' if parts else ''))


def diagnosis_sections(found, view=None, *, bag='BAG', nominal='--model MODEL.yaml'):
    """
    Return the sections of a diagnosis.

    Parameters
    ----------
    found : dict
        `Diagnosis.to_json()`; lists may be empty and numbers None, as with a reference record.
    view : GapView, optional
        Curves to draw; without it text, tables and bars remain.
    bag, nominal : str
        For the commands of the last section; `nominal` is '--model FILE' or '--reference BAG'.

    Returns
    -------
    tuple of Section

    """
    candidates = [c for c in found['candidates'] if c['effects'] and not (
        c['effects'][0] == 'none' and (c['probability'] or 0.0) < SHOWN)]
    quiet = found['outcome'] in ('WITHIN_FLOOR', 'TOO_LITTLE_DATA')
    made = [_is_there(found)]
    if found['outcome'] != 'TOO_LITTLE_DATA':
        made.append(_where(found, view, quiet))
    if not quiet:
        made += [_which(found, candidates), _how_sure(found, candidates),
                 _what_else(found, candidates)]
    if found['outcome'] != 'TOO_LITTLE_DATA':
        made.append(_how_far(found, candidates, view, quiet))
    made.append(_next(found, bag, nominal))
    return tuple(made)


def _is_there(found):
    gap = found['gap']
    lines = [f'{OUTCOMES.get(found["outcome"], found["outcome"])}: {found["reason"]}.']
    lost = found.get('missing', {}).get('text')
    lines += [f'{lost[0].upper()}{lost[1:]}.'] if lost else []
    lines += [f'Detected: {s.rstrip(".")}.' for s in found.get('signs', ())]
    if gap.get('before') is None:
        return Section('Is there a gap?', tuple(lines))
    above = (gap['before'] - gap['floor']) / gap['floor_std'] if gap.get('floor_std') else None
    table = Table(('gap [nats a band]', 'floor of a right model', 'above the floor', 'p-value'),
                  ((fixed(gap['before'], 4),
                    with_spread(gap['floor'], gap['floor_std'] or 0.0, 4, '±'),
                    f'{number(above)} standard deviations', _p_value(gap.get('p_value'))),))
    return Section('Is there a gap?', tuple(lines), (table,))


def _p_value(p):
    return '-' if p is None else p_value_text(p)


def _probability(candidate):
    probability = candidate['probability']
    return '-' if probability is None else probability_text(probability)


def _where(found, view, quiet):
    lines = ('Shares of the gap above its floor. Chance alone has such shares, too: here they '
             'point at nothing.',) if quiet else ()
    pictures, tables = where_pictures(found['where']), (_leading(found['where']),)
    if view is not None:
        pictures += tuple(p for p in maps(view) if p.name.endswith('before'))
    if not pictures:
        lines += ('No frequency band is above the floor.',)
    return Section('Where is it?', lines, tables if tables[0].rows else (), pictures)


def _leading(where):
    """Return the largest shares of each kind as a table."""
    names = {'sensors': lambda e: e['name'],
             'bands': lambda e: f'{e["low_hz"]:.3g} to {e["high_hz"]:.3g} Hz',
             'modes': lambda e: f'{e["frequency_hz"]:.3f} Hz {e["name"]}',
             'times': lambda e: f'{e["start_s"]:.0f} to {e["end_s"]:.0f} s'}
    rows = [('site', *_best([(v, k) for k, v in where['site'].items()]))]
    for kind, name in names.items():
        shares = [e['share'] for e in where[kind]]
        if kind == 'times' and shares and max(shares) < EVEN / len(shares):
            rows.append((kind, 'evenly over the record', '', ''))
        else:
            rows.append((kind, *_best(list(zip(shares, map(name, where[kind]))))))
    return Table(('by', 'most', 'second', 'third'), tuple(r for r in rows if r[1]))


def _best(shares):
    best = sorted(((s, n) for s, n in shares if s), reverse=True)[:3]
    return [f'{n}: {percent(s)}' for s, n in best] + [''] * (3 - len(best))


def _which(found, candidates):
    verdict = found['verdict']
    named = ' + '.join(verdict['effects']) or 'none of these'
    lines = (f'The most probable effect is {named}, probability {_probability(verdict)}.',)
    rows = []
    for c in candidates:
        known = c['effects'][0] not in OPEN
        rows.append((
            candidate_name(c), _probability(c),
            '; '.join(filter(None, (_at(c, n) for n in c['effects'])))
            or MEANING.get(c['effects'][0], ''),
            f'{percent(c["closed"])} ({interval(c)})'
            if known and c['closed'] is not None else '-',
            ('yes' if c['inside_floor'] else 'no') if known else '-'))
    heads = ('candidate', 'probability', 'at', 'removes of the gap (90 % interval)',
             'residual gap inside its floor')
    table = Table(heads, tuple(rows), 'Best first; a share of more than 100 % is noise')
    return Section('Which effect is it?', lines, (table,), candidate_pictures(candidates))


def _at(candidate, effect):
    """Return places and sizes of one effect of a candidate, 'array E1, scale 1.02 +- 0.01'."""
    places, numbers = quantities(candidate, effect)
    return ', '.join(places + [f'{name} {size}' for name, size in compact(numbers)])


def _how_sure(found, candidates):
    verdict, best = found['verdict'], candidates[0] if candidates else None
    lines = [f'The probability of {listed(verdict["class"]) or "none of these effects"} is '
             f'{_probability(verdict)}.']
    numbers = [n for name in (best['effects'] if best else ()) for n in quantities(best, name)[1]]
    if len(numbers) > MOST:
        tables = (_by_mode(numbers),)
    else:
        rows = [(k, measured(v['value'], v['unit'], 6), number(v['std'], 2),
                 f'{number(v["low90"], 6)} to {number(v["high90"], 6)}'
                 if v['low90'] is not None else '-') for k, v in numbers]
        tables = (Table(('parameter', 'value', '± 1 standard deviation', '90 % interval'),
                        tuple(rows)),) if rows else ()
    return Section('How sure is that?', tuple(lines), tables)


def _by_mode(numbers):
    """Return numbers of many modes as a table with a row a mode and a column a quantity."""
    cells = {}
    for name, value in numbers:
        stem, _, at = name.partition(' at ')
        std = value['std'] if value['std'] is not None else 0.0
        cells.setdefault(at or 'all', {})[stem] = with_spread(value['value'], std, 5, '±')
    stems = list(dict.fromkeys(stem for row in cells.values() for stem in row))
    return Table(('mode', *stems), tuple(
        (at, *(row.get(stem, '-') for stem in stems)) for at, row in sorted(
            cells.items(), key=lambda item: float(item[0].split()[0]) if item[0] != 'all' else 0)),
        'Numbers of the most probable effect of the library, ± one standard deviation')


def _what_else(found, candidates):
    alike = [n for n in found['verdict']['class'] if n not in found['verdict']['effects']]
    lines = []
    if alike:
        lines.append(f'This record does not distinguish it from {listed(alike)}.')
    for c in candidates[1:]:
        if (c['probability'] or 0.0) >= SHOWN:
            meaning = MEANING.get(c['effects'][0])
            lines.append(f'{candidate_name(c)}: probability {_probability(c)}'
                         + (f' ({meaning})' if meaning else '') + '.')
    if not lines:
        lines.append('No other effect of the library has a probability of 0.01 or more.')
    if found['separate_by']:
        lines.append(f'What would distinguish them: {"; ".join(found["separate_by"])}.')
    return Section('What else could it be?', tuple(lines))


def _how_far(found, candidates, view, quiet):
    lines, tables, pictures = [], (), ()
    best = candidates[0] if candidates else None
    if quiet or best is None or best['effects'][0] in OPEN:
        lines.append('There is no effect to correct; the curves show the record and what is '
                     'expected of it.')
    else:
        share, which = removed(best), candidate_name(best)
        where = 'inside' if best['inside_floor'] else 'above'
        lines.append(
            (f'Correcting {which} {share}, 90 % interval {interval(best)}, measured on segments '
             'that the fit did not use; ' if share else 'The gap of the spectra is too small to '
             f'say how much of it {which} removes; ') + f'the residual gap is {where} its floor.')
        controls = [('no effect at all' if c['effects'] == ['none'] else
                     f'an effect drawn at random ({candidate_name(c)})') + f' {removed(c)}'
                    for c in found.get('controls', ()) if c['closed'] is not None]
        if controls:
            lines.append(f'For comparison, measured in the same way: {"; ".join(controls)}.')
    if view is not None:
        after = view.after.expected if view.after is not None else None
        pictures = (spectra(view.channels, view.frame, view.record, view.before.expected, after,
                            'gap_spectra', view.nominal), *(() if quiet else zooms(view)),
                    *(p for p in maps(view) if p.name.endswith('after')))
        tables = before_after_tables(view)
    return Section('How far does it shrink?', tuple(lines), tables, pictures)


def _next(found, bag, nominal):
    outcome, model = found['outcome'], not nominal.startswith('--reference')
    apply = f'ssi_ros diagnose {bag} {nominal} --apply corrected.yaml'
    commands = (apply,) if model else ()
    ahead = f'ssi_ros identifiability {nominal}'
    if outcome == 'WITHIN_FLOOR':
        lines = ('Nothing has to be done.',)
        if model:
            lines += ('Which effects such a record shows, and from which size on:',)
            commands = (ahead,)
    elif outcome == 'EXPLAINED' and model:
        lines = ('Put the effect into the simulator and check that the gap is gone:',)
        commands = (apply, f'ssi_ros diagnose {bag} --model corrected.yaml')
    elif outcome == 'EXPLAINED':
        lines = ('Search the cause where the gap lies. With a model in place of a reference '
                 'the effect could be put into the simulator and tried:',)
        commands = (f'ssi_ros diagnose {bag} --model MODEL.yaml',)
    elif outcome == 'TIED':
        lines = ('All effects of the tie would leave the same record. What would distinguish '
                 f'them: {"; ".join(found["separate_by"]) or "a longer record"}.',)
        if model:
            lines += ('Any of them may stand in the simulator meanwhile:',)
    elif outcome == 'UNEXPLAINED':
        lines = ('The nearest effect is a hint, not an answer: the maps above show where the '
                 'residual lies. If you know a mechanism that the library lacks, add it: one '
                 'small file, see “Add an effect” in the documentation.',)
        commands = ('ssi_ros effects',)
    else:
        lines = (f'{found["reason"]}. Record longer'
                 + (', and ask beforehand what a length shows:' if model else '.'),)
        commands = (f'{ahead} --duration-s 600',) if model else ()
    return Section('What to do next?', lines, (), (), commands)
