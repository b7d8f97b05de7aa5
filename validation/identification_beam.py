"""
Follow the first mode of a beam whose roller support moves: frequency against position, and delay.

    SSI_ROS_DATA=FOLDER python -m validation.identification_beam [slow10 random]
"""
import argparse

import numpy as np
from ssi_ros.identify import Identification, identify
from ssi_ros.records import Samples

from validation.gap_reference import data_folder
from validation.report import table

CHANNELS = ('low_g_accel',)     # the other one has spikes to one side
SETTINGS = Identification(window_s=0.5, hop_s=0.1, decimation=20, cycles_min=8.0, order_max=12,
                          block_rows=20, weighting='upc', bands=1)
FIRST_HZ = 20.0, 50.0       # where the first mode may be, at any position
STEADY_V, STEADY_S = 0.03, 0.5      # range of the roller while it stands still, and how long
NEAR = 0.02                 # relative distance from the frequency of a position
HEAD = ('stands from [s]', 'to [s]', 'position [V]', 'windows', 'with first mode',
        'frequency [Hz]', 'spread [Hz]', 'delay after the step [s]')


def first_mode(window):
    """Return the frequency of the lightest damped mode of a window in the band, or NaN."""
    found = [m for m in window.modes if FIRST_HZ[0] < m.frequency_hz < FIRST_HZ[1]]
    return min(found, key=lambda m: m.damping_ratio).frequency_hz if found else np.nan


def standing(place, rate_hz):
    """Yield first and last time [s] of every interval in which the roller stands still."""
    block = int(0.05 * rate_hz)
    count = len(place) // block
    middles = place[:count * block].reshape(count, block).mean(axis=1)
    first = 0
    for k in range(1, count + 1):
        if k == count or np.ptp(middles[first:k + 1]) > STEADY_V:
            if (k - first) * block / rate_hz >= STEADY_S:
                yield first * block / rate_hz, k * block / rate_hz
            first = k


def rows(name):
    """Yield the cells of every position of a recording."""
    data = np.load(data_folder() / f'dropbear_{name}_0.npz')
    place, rate_hz = data['pinloc'], 5000.0
    values = np.column_stack([data[c] for c in CHANNELS]).astype(float)
    windows = identify(Samples(values, rate_hz, CHANNELS), SETTINGS)
    ends = np.array([1e-9 * w.end_ns for w in windows])
    found = np.array([first_mode(w) for w in windows])
    for begin, end in standing(place, rate_hz):
        there = (ends > begin + SETTINGS.window_s) & (ends <= end + 1e-9)
        level = place[int(begin * rate_hz):int(end * rate_hz)].mean()
        known = found[there & np.isfinite(found)]
        usual = np.median(known) if len(known) else np.nan
        after = (ends > begin) & (ends <= end) & (np.abs(found / usual - 1) < NEAR)
        delay = f'{ends[after][0] - begin:.2f}' if after.any() else ''
        yield (f'{begin:.2f}', f'{end:.2f}', f'{level:.2f}', str(there.sum()), str(len(known)),
               f'{usual:.2f}', f'{np.ptp(known) if len(known) else np.nan:.2f}', delay)


def main():
    """Print a table of the positions of each recording."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='*', default=['slow10', 'random'])
    for name in parser.parse_args().names:
        print(f'\n{name}\n')
        print('\n'.join(table(HEAD, list(rows(name)))))


if __name__ == '__main__':
    main()
