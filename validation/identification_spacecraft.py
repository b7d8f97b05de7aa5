"""
Monte Carlo on the spacecraft: modes found, false modes, accuracy and spreads.

    python validation/identification_spacecraft.py --seeds 50 --window 600
"""
import argparse
import signal

import numpy as np
from ssi_ros.identify import Identification, identify
from ssi_ros.model import assemble, load_spacecraft, natural_modes, simulate

TOLERANCE = 0.01        # a mode within 1 % of a true one, one each, is found; the rest is false


def pair(true_hz, found):
    """Return (true, found) index pairs, nearest frequencies first, each used once."""
    gaps = np.abs(np.subtract.outer(true_hz, [m.frequency_hz for m in found]))
    gaps /= true_hz[:, None]
    pairs = []
    while gaps.size and gaps.min() < TOLERANCE:
        a, b = np.unravel_index(gaps.argmin(), gaps.shape)
        pairs.append((a, b))
        gaps[a], gaps[:, b] = np.inf, np.inf
    return pairs


def main():
    """Run the seeds and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seeds', type=int, default=50)
    parser.add_argument('--first', type=int, default=0, help='first seed')
    parser.add_argument('--window', type=float, default=600.0)
    args = parser.parse_args()
    system = assemble(load_spacecraft())
    modes = natural_modes(system)
    flexible = (modes.frequencies_hz > 0.1) & (modes.frequencies_hz < 32.0)
    true_hz = modes.frequencies_hz[flexible]
    true_xi = modes.damping_ratios[flexible]
    settings = Identification(window_s=args.window, hop_s=args.window / 60.0)
    table = np.full((args.seeds, len(true_hz), 4), np.nan)
    found, false, lines = [], [], 0
    for seed in range(args.seeds):
        window = identify(simulate(system, args.window, args.first + seed), settings)[-1]
        pairs = pair(true_hz, window.modes)
        found.append(len(pairs))
        false.append(len(window.modes) - len(pairs))
        lines += sum(m.label == 'input_line' for m in window.modes)
        for a, b in pairs:
            m = window.modes[b]
            table[seed, a] = (m.frequency_hz / true_hz[a] - 1.0, m.damping_ratio - true_xi[a],
                              m.frequency_std_hz / true_hz[a], m.damping_ratio_std)
    print(f'{args.seeds} seeds, {args.window:g} s: found {np.mean(found):.2f} of '
          f'{len(true_hz)}, false {np.mean(false):.2f}, called a line {lines}')
    print('| f [Hz] | found | rms df/f [%] | spread / rms | rms dxi [%] | spread / rms '
          '| bias xi [%] |')
    print('|---|---|---|---|---|---|---|')
    for a, f in enumerate(true_hz):
        t = table[:, a][np.isfinite(table[:, a, 0])]
        if len(t) < 3:
            print(f'| {f:.3f} | {len(t)} | | | | | |')
            continue
        rms, sd = np.sqrt((t[:, :2] ** 2).mean(axis=0)), t[:, :2].std(axis=0, ddof=1)
        mean = np.sqrt((t[:, 2:] ** 2).mean(axis=0))
        print(f'| {f:.3f} | {len(t)} | {100 * rms[0]:.3f} | {mean[0] / sd[0]:.2f} | '
              f'{100 * rms[1]:.3f} | {mean[1] / sd[1]:.2f} | {100 * t[:, 1].mean():+.3f} |')
    ratio = np.sqrt(np.nanmean(table[..., 2:] ** 2, axis=0)) / np.nanstd(table[..., :2], axis=0)
    fast = true_hz > 1.0
    print(f'spread over empirical above 1 Hz, median: frequency {np.median(ratio[fast, 0]):.2f}, '
          f'damping {np.median(ratio[fast, 1]):.2f}')


if __name__ == '__main__':
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)      # a reader such as head may close early
    main()
