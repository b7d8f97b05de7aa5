"""
Diagnose pairs of measured records of which it is known what separates them.

    SSI_ROS_DATA=FOLDER python -m validation.gap_known [f16 board beam splits wiring]
"""
import argparse
from dataclasses import replace
from itertools import combinations
import re
import time

import numpy as np
from ssi_ros.effects import effect_class
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.records import Samples

from validation.gap_reference import data_folder, f16, halves
from validation.report import table

HEAD = ('pair', 'known', 'answer', 'outcome', 'named', 'probability', 'site', 'event [s]', 'p',
        'CPU s')
NULL = 'nothing'
JOINT = 'play, friction: softer with level'
AMPLITUDE = 'another amplitude, rattle'
SHOCK_S = 3.83, 3.97        # when the shock is: rows 6540 to 6770
LATE_S = 0.3
CUTS = 1 / 3, 0.4, 0.5, 0.6, 2 / 3      # where one record is cut in two
PLATEAU = 0.03, 0.7         # how steady the roller is [V], and how long [s]
# effects that are right for what is known, and the site of an answer that names none
RIGHT = {JOINT: ('hinge_friction', 'hinge_freeplay'), AMPLITUDE: ()}
SITE = {JOINT: 'structure', AMPLITUDE: 'excitation', 'shock': 'excitation',
        'roller moved': 'structure'}


def f16_pairs(folder):
    """Yield name, reference, record and what is known, of three levels."""
    levels = {k: f16(k, folder) for k in (1, 2, 5)}
    for k, samples in levels.items():
        one, two = halves(samples)
        yield f'F-16 {k}, halves', one, two, NULL
        yield f'F-16 {k}, halves turned', two, one, NULL
    for i in levels:
        for j in levels:
            if i != j:
                yield f'F-16 {i} -> {j}', levels[i], levels[j], JOINT


def f16_splits(folder):
    """Yield the same of parts of one record, cut at several places, both ways."""
    for k in (1, 2, 5):
        samples = f16(k, folder)
        end = samples.duration_s
        for share in CUTS:
            one, two = samples.between(0.0, share * end), samples.between(share * end, end)
            yield f'F-16 {k}, cut at {share:.2f}', one, two, NULL
            yield f'F-16 {k}, cut at {share:.2f} turned', two, one, NULL
        thirds = [samples.between(i * end / 3, (i + 1) * end / 3) for i in range(3)]
        for i, j in ((0, 2), (2, 0), (1, 2), (1, 0)):
            yield f'F-16 {k}, third {i + 1} -> {j + 1}', thirds[i], thirds[j], NULL


def wired_pairs(folder):
    """Yield the same of halves, in the second of which a channel is reversed or two swapped."""
    for k in (1, 2, 5):
        one, two = halves(f16(k, folder))
        names = two.channels
        for i, name in enumerate(names):
            turned = np.where(np.arange(len(names)) == i, -1.0, 1.0) * two.values
            yield f'F-16 {k}, {name} reversed', one, replace(two, values=turned), f'of {name}'
        for i, j in combinations(range(len(names)), 2):
            order = [{i: j, j: i}.get(m, m) for m in range(len(names))]
            yield (f'F-16 {k}, {names[i]} and {names[j]} swapped', one,
                   replace(two, values=two.values[:, order]),
                   f'{names[i]} and {names[j]} are swapped')


def board_pairs(folder):
    """Yield the same of the circuit board: shocks against no shock, amplitudes, quiet parts."""
    data = np.load(folder / 'pcb_shock.npz')
    board = {tuple(map(float, re.findall(r'[\d.]+', k))): Samples(
        data[k].astype(float), 1 / 0.000586, ('base', 'board')) for k in data.files}
    for (shock, amplitude), samples in board.items():
        if shock:
            quiet = samples.between(0.0, 3.4)
            yield f'board {amplitude}: quiet part -> shock {shock}', quiet, samples, 'shock'
            yield f'board {amplitude}: no shock -> {shock}', board[0.0, amplitude], samples, (
                'shock')
            yield (f'board {amplitude}: before shock {shock} -> after it', quiet,
                   samples.between(4.1, samples.duration_s), NULL)
        else:
            other = next(a for s, a in board if not s and a != amplitude)
            yield f'board {amplitude} -> {other}', samples, board[0.0, other], AMPLITUDE


def beam_pairs(folder):
    """Yield the same of the beam whose roller support moves: one position against another."""
    data = np.load(folder / 'dropbear_slow10_0.npz')
    names = 'low_g_accel', 'accel'
    values, place, rate_hz = np.column_stack([data[n] for n in names]), data['pinloc'], 5000
    parts, first = [], 0
    while first < len(place):
        last = first + int(PLATEAU[1] * rate_hz)
        if last <= len(place) and np.ptp(place[first:last]) < 2 * PLATEAU[0]:
            parts.append((float(place[first:last].mean()), Samples(
                values[first:last].astype(float), rate_hz, names)))
            first = last
        first += rate_hz // 50
    for (before, one), (after, two) in zip(parts[:-1], parts[1:]):
        known = NULL if abs(after - before) < PLATEAU[0] else 'roller moved'
        yield f'beam {before:.2f} V -> {after:.2f} V', one, two, known


def row(pair, one, two, known):
    """Return the cells of a diagnosis and what it is worth."""
    begin = time.process_time()
    found = diagnose(RecordedNominal(one), two)
    took, verdict = time.process_time() - begin, found.verdict
    sites = found.where.site
    site = max(sites, key=sites.get) if any(sites.values()) else ''
    event = re.findall(r'event at ([\d.]+) s', ' '.join(found.signs))
    return (pair, known, worth(found, known, site, event), found.outcome,
            ' + '.join(verdict['effects']), f'{verdict["probability"]:.2f}', site,
            ' '.join(event), f'{found.gap["p_value"]:.2g}', f'{took:.1f}')


def worth(found, known, site, event):
    """Return what an answer is worth beside what is known."""
    named, outcome = found.verdict['class'], found.outcome
    if outcome == 'TOO_LITTLE_DATA':
        return 'refused: too short or not stationary'
    if known == NULL:
        return 'right' if outcome == 'WITHIN_FLOOR' else 'false alarm'
    if known not in SITE:
        return 'right' if known in found.reason else 'not named'
    if outcome == 'WITHIN_FLOOR':
        return 'silent'
    in_time = any(SHOCK_S[0] - LATE_S < float(t) < SHOCK_S[1] + LATE_S for t in event)
    if known == 'shock' and not in_time:
        return 'wrong time' if event else 'wrong: no time'
    right = {'shock': ('impulsive_events',)}.get(known, RIGHT.get(known))
    if outcome == 'UNEXPLAINED':
        place = site == SITE[known] or known == 'shock'
        return 'unexplained, right place' if place else 'unexplained, other place'
    if right is None:
        sites = {effect_class(n).site.value for n in named}
        return 'right' if SITE[known] in sites else 'wrong'
    return 'right or tied with it' if set(right) & set(named) else 'wrong'


PAIRS = {'f16': f16_pairs, 'board': board_pairs, 'beam': beam_pairs, 'splits': f16_splits,
         'wiring': wired_pairs}


def main():
    """Print a table of the pairs."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='*', choices=[*PAIRS, []], default=list(PAIRS))
    print('\n'.join(table(HEAD, [])[:2]), flush=True)
    for name in parser.parse_args().names:
        for pair in PAIRS[name](data_folder()):
            print('| ' + ' | '.join(row(*pair)) + ' |', flush=True)


if __name__ == '__main__':
    main()
