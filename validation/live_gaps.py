"""
The live gap meter on streams with gaps: alarms, hops measured, what is said.

    python -m validation.live_gaps [SECONDS [SEEDS]]

Streams without effect of the package's own simulator, whole library, default window and hop, alarm
declared once a day. Rows are lost one by one, or in gaps of one length at places drawn with the
seed, on all channels at once or on the second one alone.
"""
from dataclasses import replace
import sys

import numpy as np
from ssi_ros.effects import inject, simulate_setup
from ssi_ros.gap.online.calibration import LiveSettings, prepare
from ssi_ros.gap.online.sliding import LiveGap
from ssi_ros.model import load_spacecraft

SEED = 25_000_000
# share of rows that is lost, length of a gap [s], channels
CASES = ((0.0, 0.01, 'all'), (0.001, 0.01, 'all'), (0.01, 0.01, 'all'), (0.05, 0.01, 'all'),
         (0.09, 0.01, 'all'), (0.05, 0.01, 'one'), (0.2, 0.01, 'one'), (0.01, 0.1, 'all'),
         (0.05, 0.25, 'all'), (0.05, 0.25, 'one'), (0.01, 0.5, 'all'), (0.01, 2.0, 'all'),
         (0.05, 10.0, 'all'), (0.2, 10.0, 'all'), (0.2, 0.5, 'all'))


def spoilt(samples, share, length_s, where, seed):
    """Return the rows of samples without a share of them."""
    values, rng = np.array(samples.values), np.random.default_rng(seed)
    rows = max(1, round(length_s * samples.rate_hz))
    count = round(share * len(values) / rows)
    starts = np.sort(rng.choice(len(values) - count * rows, count, replace=False))
    for k, start in enumerate(starts):
        first = start + k * rows
        values[first:first + rows, 1 if where == 'one' else slice(None)] = np.nan
    return values


def main(seconds=1800.0, seeds=1):
    """Print the table."""
    craft = load_spacecraft()
    settings = replace(LiveSettings(), false_alarm_every_s=86400.0)
    model = prepare(craft, settings)
    print('| lost | hops measured | alarms | highest alarm level (0 raises) '
          '| mean deviations [sd] | reason of the last result |\n' + '|---' * 6 + '|', flush=True)
    for share, length_s, where in CASES:
        used, hops, alarms, level, deviations, last = 0, 0, 0, -np.inf, [], ''
        for seed in range(SEED, SEED + int(seeds)):
            record = simulate_setup(inject(craft, (), seconds), seed)
            meter = LiveGap(model, record.channels, 0, settings)
            updates = meter.push(spoilt(record, share, length_s, where, seed))
            used, hops = used + sum(u.measured for u in updates), hops + len(updates)
            alarms += updates[-1].raised_ns is not None
            level = max([level, *(u.alarm_level for u in updates)])
            deviations += [u.deviations for u in updates[19:] if np.isfinite(u.deviations)]
            last = updates[-1].reason
        print(f'| {100 * share:g} % in {length_s:g} s, {where} | {used} of {hops} | {alarms} of '
              f'{int(seeds)} | {level:+.1f} | '
              f'{np.mean(deviations) if deviations else float("nan"):+.2f} | {last} |', flush=True)


if __name__ == '__main__':
    main(*map(float, sys.argv[1:3]))
