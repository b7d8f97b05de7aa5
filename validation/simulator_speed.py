"""How fast the simulator is: one record, an ensemble, nonlinear hinges, the verb."""
import tempfile
import time

from ssi_ros.cli.main import main as command
from ssi_ros.model import assemble, ensemble, simulate, Spacecraft
from ssi_ros.model.nonlinear import HingeLaw, simulate_nonlinear
from ssi_ros.model.spacecraft import SolarArray
from validation.report import table, write


def least(work, runs):
    """Return the least time of several runs [s]."""
    times = []
    for i in range(runs):
        begin = time.perf_counter()
        work(i)
        times.append(time.perf_counter() - begin)
    return min(times)


def main():
    """Write the report."""
    system = assemble(Spacecraft())
    hinged = assemble(Spacecraft(arrays=(
        SolarArray(hinge_n_m_rad=2e4), SolarArray(name='E2', side=-1, hinge_n_m_rad=2e4))),
        explicit_hinges=True)
    rows = [['600 s of 4 x 100 Hz', f'{least(lambda i: simulate(system, 600.0, i), 5):.3f}',
             '0.3'],
            ['100 records of 600 s, one core',
             f'{least(lambda i: list(ensemble(system, 600.0, range(100))), 1):.2f}',
             '10 (two cores)']]
    for kind, size in (('freeplay', 1e-5), ('friction', 0.05), ('cubic', 1e12)):
        laws = (HingeLaw('E1_hinge', kind, size), HingeLaw('E2_hinge', kind, size))
        simulate_nonlinear(hinged, 1.0, 1, laws=laws)         # compile
        took = least(lambda i: simulate_nonlinear(hinged, 600.0, i, laws=laws), 3)
        rows.append([f'{kind} in both hinges, 600 s at 1 kHz inside', f'{took:.2f}', '3'])
    with tempfile.TemporaryDirectory() as folder:
        took = least(lambda i: command(['simulate', f'{folder}/{i}', '--seed', str(i)]), 3)
    rows.append(['verb simulate, 600 s to a bag', f'{took:.2f}', '6 (100 times real time)'])
    write('simulator_speed', 'Speed of the simulator', [
        'Least of several runs, one thread, on a machine that others were using.', '',
        *table(['what', 'seconds', 'target'], rows)])


if __name__ == '__main__':
    main()
