"""
Diagnose halves of records, of the F-16 and of a simulated bridge, with one channel changed.

    SSI_ROS_DATA=FOLDER python -m validation.gap_changed
"""
from dataclasses import replace
import time

import numpy as np
from scipy.signal import butter, lfilter
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal

from validation.gap_reference import bridge, data_folder, f16, halves
from validation.report import table

HEAD = 'record', 'put in', 'outcome', 'named', 'probability', 'size put in', 'found', 'CPU s'
CHANNEL = 1
GAIN = 1.05
CORNER = 0.125, 0.25        # of the low-pass over half of the rate: F-16, bridge


def records(folder):
    """Yield name, both halves, and the corner of a low-pass [Hz]."""
    for level in (1, 5):
        yield (f'F-16 {level}', *halves(f16(level, folder)), 200 * CORNER[0])
    yield 'bridge', *halves(bridge(folder)), 7.5 * CORNER[1]


def changes(rate_hz, corner_hz):
    """Yield effect, parameter, its size, and the change of a column; None without any."""
    yield 'nothing', '', np.nan, None
    yield 'sensor_gain', 'scale', GAIN, lambda v: GAIN * v
    yield 'channel_delay', 'delay_s', 1 / rate_hz, lambda v: np.append(v[:1], v[:-1])
    yield 'sensor_bandwidth', 'corner_hz', corner_hz, lambda v: lfilter(
        *butter(2, 2 * corner_hz / rate_hz), v)


def main():
    """Print one row a record and a change."""
    rows = []
    for name, one, two, corner_hz in records(data_folder()):
        for effect, quantity, size, change in changes(two.rate_hz, corner_hz):
            values, begin = two.values.copy(), time.process_time()
            if change:
                values[:, CHANNEL] = change(values[:, CHANNEL])
            found = diagnose(RecordedNominal(one), replace(two, values=values))
            got = found.candidates[0].parameters.get(f'{effect}.{quantity}')
            rows.append((name, effect, found.outcome, ' + '.join(found.verdict['effects']),
                         f'{found.verdict["probability"]:.2f}', f'{size:.5g}',
                         f'{got.value:.5g} [{got.low90:.5g}, {got.high90:.5g}]' if got else '',
                         f'{time.process_time() - begin:.1f}'))
    print('\n'.join(table(HEAD, rows)))


if __name__ == '__main__':
    main()
