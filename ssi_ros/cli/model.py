"""
Show the modes of a model: frequency, damping, and whether the excitation drives them.

FILE is the YAML of a spacecraft, or the matrices, modes or state space of any structure in a .npz
or .mat; of such a model also the stiffness and mass at its points, which effects are shares of.

With --reach also how long a record each mode needs: for 0.1 % of its frequency, for 10 % of its
damping, and `apart`, until four standard deviations of its frequency fit between it and its
neighbour. Those are Cramer-Rao bounds, so no unbiased method needs less. Excitations as in
`ssi_ros simulate`.
"""
from pathlib import Path

HELP = 'frequencies, damping and reach of the model'
EXAMPLE = 'ssi_ros model --excitation torque --reach'
EXCITATIONS = ('ambient', 'torque', 'process')


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('model', metavar='FILE', nargs='?',
                        help='spacecraft YAML, or .npz or .mat (default: the packaged spacecraft)')
    parser.add_argument('--config', metavar='FILE', help='the same')
    parser.add_argument('--excitation', choices=EXCITATIONS, default='ambient',
                        help='what acts on it (default: ambient)')
    parser.add_argument('--reach', action='store_true',
                        help='show the record length that every mode needs')
    parser.add_argument('--npz', type=Path, metavar='FILE',
                        help='write matrices and names there, for --model of other verbs')


def run(args):
    """Print the table, write the matrices."""
    from ssi_ros.cli._options import say_taken
    from ssi_ros.effects import inject, load_configuration
    from ssi_ros.model.reach import reach

    if args.model and args.config:
        raise ValueError('FILE and --config name two models; give one')
    model, effects = load_configuration(args.model or args.config)
    say_taken(args.model or args.config)
    setup = inject(model)
    system = setup.system
    modes = reach(system, chosen(system, args.excitation))
    print(_table(modes, args.reach))
    count = sum(m.verdict == 'reached' for m in modes)
    print(f'{count} of {len(modes)} modes are reached by the excitation {args.excitation}')
    print(_known(model))
    if effects:
        print('without the effects of the file: ' + ' '.join(e.text() for e in effects))
    if not model.arrays:
        print('\n'.join(_points(setup)))
    if args.npz:
        from ssi_ros.model.model_file import save_model, save_system
        if model.arrays:
            save_system(system, args.npz)
        else:
            save_model(model, args.npz, [e.text() for e in effects])
        print(f'wrote {args.npz}')
    return 0


def _points(setup):
    """Return stiffness and mass of the points of a model without geometry, as lines."""
    from ssi_ros.effects import effect_class, left_out, places
    from ssi_ros.effects.points import mass_at, row_between, stiffness_between

    lines = list(left_out(setup.spacecraft))
    pairs = list(places(effect_class('connection_stiffness'), setup.spacecraft))
    if pairs:
        lines.append(f'{"between":<16}{"and":<16}{"stiffness k":>13}{"mass m":>13}')
    for pair in pairs:
        row = row_between(setup, **pair)
        lines.append(f'{pair["freedom"]:<16}{pair["to"]:<16}'
                     f'{stiffness_between(setup.system, row):>13.4g}'
                     f'{mass_at(setup.system, row):>13.4g}')
    return lines


def _known(model):
    """Return how wrong the numbers of a model may be, as a line."""
    import numpy as np

    from ssi_ros.model.modal_errors import MOST
    if model.calibration.covariance:
        return (f'calibrated on {", ".join(model.calibration.recordings) or "recordings"}: '
                'a diagnosis counts with what that left unknown')
    given = model.uncertainty
    if given.exact:
        return 'its numbers are declared exact; a diagnosis takes any difference for an effect'
    if not model.arrays:
        rms = {kind: float(np.sqrt(np.mean(np.square(getattr(given, kind))))) for kind in MOST}
        return 'declared standard deviations (uncertainty_..., rms): ' + ', '.join(
            f'{kind} {100 * value:.3g} %' for kind, value in rms.items() if value)
    parts = [f'{label} {100 * value:g} %' for label, value in (
        ('frequencies', given.frequency), ('damping', given.damping),
        ('participation', given.participation), ('shapes', given.shape),
        ('inertia of the hub', given.hub_inertia), ('gains', given.gain)) if value]
    parts += [f'places of sensors {1000 * given.sensor_place_m:g} mm'] * bool(given.sensor_place_m)
    parts += [f'forces on the modes {100 * given.modal_force:g} %'] * bool(given.modal_force)
    parts += [f'{len(given.modes)} modes on their own'] * bool(given.modes)
    return 'declared standard deviations (uncertainty:): ' + ', '.join(parts)


def chosen(system, name):
    """Return the parts of a system's excitation that a name of EXCITATIONS stands for."""
    if name != 'ambient' and not any(p.name.startswith('torque') for p in system.excitation):
        raise ValueError(f'excitation {name} is one of a spacecraft; this model has the inputs '
                         f'{", ".join(system.inputs)}, with their levels as it says: leave out '
                         '--excitation')
    only = {'ambient': None, 'torque': 'torque', 'process': 'process_noise'}[name]
    return tuple(p for p in system.excitation if only is None or p.name.startswith(only))


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
                f'{_length(value, m.frequency_hz):>{width}}'
                for value, width in ((m.frequency_s, 13), (m.damping_s, 13), (m.apart_s, 11)))
        lines.append(line)
    return '\n'.join(lines)


def _length(value_s, frequency_hz):
    """Return a length of record as text; what is less than a cycle is not known better."""
    if not value_s < 1e6:
        return '-'
    cycle_s = 1.0 / frequency_hz
    return f'{value_s:.1f}' if value_s >= cycle_s else f'< {cycle_s:.2g}'
