"""
Place accelerometers where they tell most about the modes.

The gain is by how much the frequencies become surer than with the present sensors, geometric mean
over the modes; a record may be shorter by its square for the same spread.
"""
HELP = 'place accelerometers on the arrays'
EXAMPLE = 'ssi_ros place --count 4 --method pso --seed 1'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--config', metavar='FILE',
                        help='spacecraft YAML (default: the packaged one)')
    parser.add_argument('--count', type=int, default=4, help='number of sensors (default: 4)')
    parser.add_argument('--method', choices=('efi', 'pso', 'both'), default='both',
                        help='effective independence, particle swarm (default: both)')
    parser.add_argument('--modes', metavar='N,N,...',
                        help='modes of interest by number (default: all that are excited)')
    parser.add_argument('--seed', type=int, default=1, help='seed of the swarm (default: 1)')
    parser.add_argument('--rounds', type=int, default=40,
                        help='how often the swarm moves (default: 40)')


def run(args):
    """Print the layouts and their gain over the present one."""
    from ssi_ros.cli._options import Progress
    from ssi_ros.model import assemble, load_spacecraft
    from ssi_ros.model.model_file import is_model_file
    from ssi_ros.model.placement import (
        effective_independence, particle_swarm, present, Scene)

    if is_model_file(args.config):
        raise ValueError(f'{args.config} has no geometry to place sensors on; give the YAML of a '
                         'spacecraft')
    craft = load_spacecraft(args.config)
    system = assemble(craft)
    scene = Scene(craft, system, _modes(args.modes))
    layouts = [present(scene)]
    if args.method in ('efi', 'both'):
        layouts.append(effective_independence(scene, args.count))
    if args.method in ('pso', 'both'):
        with Progress('particle swarm') as progress:
            layouts.append(particle_swarm(scene, args.count, args.seed, rounds=args.rounds,
                                          start=layouts, progress=progress))
    for layout in layouts:
        print(f'{layout.method}: gain {layout.gain:.4f}')
        for array, along_m, lateral_m in layout.places:
            print(f'  {array}  along_m {along_m:.3f}  lateral_m {lateral_m:+.3f}')
    return 0


def _modes(text):
    if text is None:
        return None
    try:
        numbers = [int(word) for word in text.split(',')]
    except ValueError:
        raise ValueError(f'--modes {text!r} must be numbers with commas, such as 1,2,3') from None
    if not numbers or min(numbers) < 1:
        raise ValueError(f'--modes {text!r}: modes are numbered from 1')
    return [n - 1 for n in numbers]
