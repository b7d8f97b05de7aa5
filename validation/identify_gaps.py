"""
Modes of records with gaps: found, false, errors, spreads, against the same records without.

    python -m validation.identify_gaps SEEDS [WINDOW_S]

Records of the package's own spacecraft. Gaps of one length take a share of the rows, at places
drawn with the seed: of all channels at once ('all'), or of each at places of its own ('own').
"""
import sys
import time

import numpy as np
from ssi_ros.identify import Identification, identify
from ssi_ros.model import assemble, load_spacecraft, natural_modes, simulate
from ssi_ros.records import Samples

from validation.identification_spacecraft import pair

SHARES = (0.01, 0.05, 0.2)
LENGTHS_S = (0.5, 2.0, 10.0)
SEED = 24_000_000


def with_gaps(samples, share, length_s, own, seed):
    """Return samples without a share of their rows, in gaps of one length that do not overlap."""
    values, rng = np.array(samples.values), np.random.default_rng(seed)
    rows = round(length_s * samples.rate_hz)
    count = max(1, round(share * len(values) / rows))
    for c in range(values.shape[1] if own else 1):
        starts = np.sort(rng.choice(len(values) - count * rows, count, replace=False))
        for k, start in enumerate(starts):
            first = start + k * rows
            values[first:first + rows, c if own else slice(None)] = np.nan
    return Samples(values, samples.rate_hz, samples.channels, samples.start_ns)


def without(samples, channel, begin, end):
    """Return samples that lack one channel between two shares of the record."""
    values = np.array(samples.values)
    values[round(begin * len(values)):round(end * len(values)), channel] = np.nan
    return Samples(values, samples.rate_hz, samples.channels, samples.start_ns)


def errors(windows, true_hz, true_xi):
    """Return modes found and false modes a window, and what their numbers miss, (n, 3)."""
    found, false, rows = [], [], []
    for w in windows:
        pairs = pair(true_hz, w.modes)
        found.append(len(pairs))
        false.append(sum(m.label == 'structural' for m in w.modes)
                     - sum(w.modes[b].label == 'structural' for _, b in pairs))
        rows += [((w.modes[b].frequency_hz - true_hz[a]) / w.modes[b].frequency_std_hz,
                  w.modes[b].frequency_hz / true_hz[a] - 1.0,
                  w.modes[b].damping_ratio / true_xi[a] - 1.0) for a, b in pairs]
    return np.mean(found), np.mean(false), np.array(rows).reshape(-1, 3)


def main(seeds, window_s=120.0):
    """Print the table."""
    system = assemble(load_spacecraft())
    modes = natural_modes(system)
    flexible = (modes.frequencies_hz > 20.0 / window_s) & (modes.frequencies_hz < 32.0)
    true = modes.frequencies_hz[flexible], modes.damping_ratios[flexible]
    settings = Identification(window_s=window_s, hop_s=window_s / 60.0)
    records = [simulate(system, window_s, SEED + k) for k in range(seeds)]
    cases = [('none', 0.0, 0.0, False)] + [
        (f'{100 * s:g} % in {length:g} s, {"own" if own else "all"}', s, length, own)
        for s in SHARES for length in LENGTHS_S for own in (False, True)
        if s * window_s >= 0.5 * length]
    print(f'{len(true[0])} modes between {true[0].min():.3g} and {true[0].max():.3g} Hz\n')
    print('| missing | found | false | rms df/f [%] | rms dxi/xi [%] | mean dxi/xi [%] '
          '| rms df over spread | CPU s |\n' + '|---' * 8 + '|', flush=True)
    for name, share, length_s, own in cases:
        begin = time.process_time()
        windows = [identify(with_gaps(r, share, length_s, own, SEED + k) if share else r,
                            settings)[-1] for k, r in enumerate(records)]
        took = (time.process_time() - begin) / seeds
        found, false, off = errors(windows, *true)
        rms = np.sqrt(np.nanmedian(off ** 2, axis=0)) / 0.6745
        print(f'| {name} | {found:.1f} | {false:.1f} | {100 * rms[1]:.3f} | {100 * rms[2]:.0f} '
              f'| {100 * np.median(off[:, 2]):+.0f} | {rms[0]:.2f} | {took:.2f} |', flush=True)
        reasons = {w.reason for w in windows if w.reason}
        print(f'<!-- {sorted(reasons)[:2]} -->', flush=True)
    for name, begin, end in (('dies at half', 0.5, 1.0), ('dies at 70 %', 0.7, 1.0),
                             ('starts at 30 %', 0.0, 0.3), ('dead', 0.0, 1.0)):
        windows = [identify(without(r, 1, begin, end), settings)[-1] for r in records]
        found, false, off = errors(windows, *true)
        rms = np.sqrt(np.nanmedian(off ** 2, axis=0)) / 0.6745
        print(f'| one of four channels {name} | {found:.1f} | {false:.1f} | {100 * rms[1]:.3f} | '
              f'{100 * rms[2]:.0f} | {100 * np.median(off[:, 2]):+.0f} | {rms[0]:.2f} | |')
        print(f'<!-- {sorted({w.reason for w in windows})[:1]} -->', flush=True)


if __name__ == '__main__':
    main(int(sys.argv[1]), *map(float, sys.argv[2:3]))
