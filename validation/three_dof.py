"""
Table 1 of the product: the paper's three masses under its three excitations.

Also figures like the paper's 4 to 11.
"""
import numpy as np

from ssi_ros.identify import Identification, identify
from ssi_ros.model import natural_modes, simulate
from ssi_ros.model.excitation import begin_all
from ssi_ros.model.three_dof import excitation_of, EXCITATIONS, LINE_HZ, three_dof
from validation.report import figure, table, write

PUBLISHED_HZ = (7.0831, 19.8462, 28.6787)        # paper, section 5.1
SEED = 1
# The pure sine shows the modes only while the transient of the start lasts.
LENGTH_S = {'white': 600.0, 'white_and_sine': 600.0, 'sine': 60.0}


def nearest(modes, frequency_hz):
    """Return the mode nearest to a frequency, None if it is more than 1 % away."""
    best = min(modes, key=lambda m: abs(m.frequency_hz - frequency_hz), default=None)
    near = best is not None and abs(best.frequency_hz / frequency_hz - 1) < 0.01
    return best if near else None


def main():
    """Write the report."""
    system = three_dof()
    theory = natural_modes(system).frequencies_hz
    rows, notes = [], []
    for case in EXCITATIONS:
        samples = simulate(system, LENGTH_S[case], SEED, excitation=excitation_of(case),
                           at_rest=True)
        window = identify(samples, Identification(window_s=LENGTH_S[case],
                                                  hop_s=LENGTH_S[case] / 60))[-1]
        sure = [m for m in window.modes if not m.frequency_std_hz > 0.01 * m.frequency_hz]
        found = [nearest(sure, f) for f in theory]
        line = nearest(sure, LINE_HZ)
        rows.append([case, f'{LENGTH_S[case]:g}', *(
            '-' if m is None else f'{m.frequency_hz:.4f} ({100 * (m.frequency_hz / f - 1):+.3f} %)'
            for m, f in zip(found, theory)),
            '-' if line is None else f'{line.frequency_hz:.4f}, damping '
            f'{100 * line.damping_ratio:.4f} %, labelled {line.label}'])
        rest = [m for m in sure if all(m is not k for k in (*found, line))]
        if rest:
            notes.append(f'{case}: also ' + ', '.join(
                f'{m.frequency_hz:.3f} Hz (damping {100 * m.damping_ratio:.2f} %, {m.label})'
                for m in rest))
        figures(system, case)
    lines = ['Theory: ' + ', '.join(f'{f:.4f}' for f in theory) + ' Hz; the paper gives '
             + ', '.join(map(str, PUBLISHED_HZ)) + ' Hz. White force 1 N rms at 100 Hz, sine '
             '1 N at 12 Hz for the whole record, damping 0.5 % and displacement noise 1e-6 m rms '
             '(ours), start at rest, 100 Hz, one channel.', '',
             *table(['excitation', 'record [s]', 'mode 1 [Hz]', 'mode 2 [Hz]', 'mode 3 [Hz]',
                     'at 12 Hz [Hz]'], rows), *notes, '',
             'A pure sine excites nothing else once the transient is over: the third case shows '
             'the modes only because the record begins at rest, with the transient in it.', '',
             'Figures: `docs/figures/three_dof_*.png`.']
    write('three_dof', 'Table 1: three masses', lines, seed=SEED)


def figures(system, case):
    """Draw the force, the displacement and its spectrum (paper, Figs. 4 to 11)."""
    parts = excitation_of(case)
    force = begin_all(parts, 100.0, system.inputs, SEED)(0, 1000)[:, 0]
    values = simulate(system, 60.0, SEED, excitation=parts, at_rest=True).values[:, 0]
    shape, save = figure(f'three_dof_{case}.png')
    axes = shape.subplots(3, 1)
    t = np.arange(1000) / 100.0
    axes[0].plot(t, force, lw=0.5)
    axes[0].set(xlabel='time [s]', ylabel='force [N]')
    axes[1].plot(t, values[:1000], lw=0.5)
    axes[1].set(xlabel='time [s]', ylabel='x_1 [m]')
    spectrum = np.abs(np.fft.rfft(values * np.hanning(len(values)))) * 4 / len(values)
    axes[2].semilogy(np.fft.rfftfreq(len(values), 0.01), spectrum, lw=0.5)
    axes[2].set(xlabel='frequency [Hz]', ylabel='amplitude [m]')
    save()


if __name__ == '__main__':
    main()
