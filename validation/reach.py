"""Reach of the default spacecraft: torque alone, process noise alone, both."""
import math

from ssi_ros.model import assemble, Spacecraft
from ssi_ros.model.reach import reach
from validation.report import table, write


def main():
    """Write the report."""
    system = assemble(Spacecraft())
    torque, process = system.excitation
    lines = ['Lengths of record for a standard deviation of 0.1 % in frequency, 10 % in damping '
             'and a quarter of the distance to the next mode: Cramer-Rao bounds with levels '
             'unknown, eq. (32) to (34) of the theory. "formula" is xi / (2 pi f (0.1 %)^2), the '
             'limit for one mode without noise. How close the identifier comes: table3.md.', '']
    for name, parts in (('Torque about x_b alone', (torque,)), ('Process noise alone', (process,)),
                        ('Both', None)):
        modes = reach(system, parts)
        count = sum(m.verdict == 'reached' for m in modes)
        lines += [f'## {name}: {count} of {len(modes)} reached', '', *table(
            ['mode', 'frequency [Hz]', 'verdict', 'peak over noise', '0.1 % f [s]', 'formula [s]',
             '10 % damping [s]', 'apart [s]'],
            [[i + 1, f'{m.frequency_hz:.4f}', m.verdict, f'{m.peak_to_noise:.1e}', *(
                f'{v:.1f}' if math.isfinite(v) else '-' for v in (
                    m.frequency_s, m.damping_ratio / (2 * math.pi * m.frequency_hz * 1e-6)
                    if math.isfinite(m.frequency_s) else math.inf, m.damping_s, m.apart_s))]
             for i, m in enumerate(modes)])]
    write('reach', 'Reach', lines)


if __name__ == '__main__':
    main()
