"""
Count the screens of the monitor that have an arrow of drift where nothing drifts.

    python -m validation.monitor_arrows [RECORDS]

Records of the packaged spacecraft without an effect, 900 s each, windows of 120 s, a result every
30 s; a screen is a result with the windows before it that the monitor shows.
"""
import sys

from ssi_ros.effects import inject, load_configuration, simulate_setup
from ssi_ros.identify import Identification, identify
from ssi_ros.monitor.watch import Watch, with_window
from ssi_ros.monitor.words import mode_lines

DURATION_S, WINDOW_S, HOP_S, SEED = 900.0, 120.0, 30.0, 4000


def screens(samples):
    """Return for every screen of a record whether it has an arrow."""
    watch, out = Watch(), []
    for k, window in enumerate(identify(samples, Identification(window_s=WINDOW_S,
                                                                hop_s=HOP_S))):
        watch = with_window(watch, window, float(k))
        out.append(any(mark in line for line in mode_lines(watch) for mark in '↑↓'))
    return out


def main(records):
    """Print the share of screens with an arrow."""
    setup = inject(load_configuration(None)[0], (), DURATION_S)
    total = wrong = 0
    for seed in range(SEED, SEED + records):
        found = screens(simulate_setup(setup, seed))
        total, wrong = total + len(found), wrong + sum(found)
        print(f'{wrong} of {total} screens ({100 * wrong / total:.1f} %) of '
              f'{seed - SEED + 1} records have an arrow', flush=True)


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
