"""
Show the modes of a spacecraft: frequency, damping, and whether the excitation drives them.

With --reach also how long a record each mode needs; those are Cramer-Rao bounds, so no unbiased
method needs less. Excitations as in `ssi_ros simulate`.
"""
from pathlib import Path

HELP = 'frequencies, damping and reach of the model'
EXAMPLE = 'ssi_ros model --excitation torque --reach'
EXCITATIONS = ('ambient', 'torque', 'process')


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--config', metavar='FILE',
                        help='spacecraft YAML (default: the packaged one)')
    parser.add_argument('--excitation', choices=EXCITATIONS, default='ambient',
                        help='what acts on it (default: ambient)')
    parser.add_argument('--reach', action='store_true',
                        help='show the record length that every mode needs')
    parser.add_argument('--npz', type=Path, metavar='FILE',
                        help='write mass, damping, stiffness, input and sensor there')


def run(args):
    """Print the table, write the matrices."""
    from ssi_ros.model import assemble, load_spacecraft
    from ssi_ros.model.reach import reach

    system = assemble(load_spacecraft(args.config))
    modes = reach(system, chosen(system, args.excitation))
    print(_table(modes, args.reach))
    count = sum(m.verdict == 'reached' for m in modes)
    print(f'{count} of {len(modes)} modes are reached by the excitation {args.excitation}')
    if args.npz:
        import numpy as np
        with args.npz.open('wb') as file:
            np.savez(file, mass=system.mass, damping=system.damping, stiffness=system.stiffness,
                     input=system.input, sensor=system.sensor, dofs=np.array(system.dofs),
                     inputs=np.array(system.inputs), channels=np.array(system.channels))
        print(f'wrote {args.npz}')
    return 0


def chosen(system, name):
    """Return the parts of a system's excitation that a name of EXCITATIONS stands for."""
    only = {'ambient': None, 'torque': 'torque', 'process': 'process_noise'}[name]
    return tuple(p for p in system.excitation if only is None or p.name == only)


def _table(modes, lengths):
    head = f'{"mode":>4}{"frequency [Hz]":>16}{"damping [%]":>13}  {"verdict":<16}{"rms":>10}'
    if lengths:
        head += f'{"peak/noise":>12}{"0.1 % f [s]":>13}{"10 % xi [s]":>13}{"apart [s]":>11}'
    lines = [head]
    for number, m in enumerate(modes, 1):
        line = (f'{number:>4}{m.frequency_hz:>16.4f}{100 * m.damping_ratio:>13.3f}  '
                f'{m.verdict:<16}{m.rms:>10.2e}')
        if lengths:
            line += f'{m.peak_to_noise:>12.1e}' + ''.join(
                f'{value:>{width}.1f}' if value < 1e6 else f'{"-":>{width}}'
                for value, width in ((m.frequency_s, 13), (m.damping_s, 13), (m.apart_s, 11)))
        lines.append(line)
    return '\n'.join(lines)
