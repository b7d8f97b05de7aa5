"""
Simulate a spacecraft, or any structure given by matrices, to a bag, faster than real time.

The samples are those that the simulator node publishes for the same seed. Excitations: `ambient`
is what the configuration says, `torque` its torque alone, `process` its process noise alone.
"""
from pathlib import Path

HELP = 'simulate accelerometers to a bag'
EXAMPLE = 'ssi_ros simulate quiet --duration-s 600 --seed 1'
COPIES = 4          # of the samples that there are at once


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._options import between
    from ssi_ros.cli._outputs import add_overwrite
    from ssi_ros.cli.model import EXCITATIONS
    add_overwrite(parser)
    parser.add_argument('bag', type=Path, metavar='BAG', help='folder to make')
    parser.add_argument('--duration-s', type=float, default=600.0,
                        help='length of the record [s] (default: 600)')
    parser.add_argument('--seed', type=int, default=1,
                        help='seed of all random numbers (default: 1)')
    parser.add_argument('--model', '--config', dest='config', metavar='FILE',
                        help='spacecraft YAML, or .npz or .mat of any structure (default: the '
                        'packaged spacecraft)')
    parser.add_argument('--excitation', choices=EXCITATIONS, default='ambient',
                        help='what acts on it (default: ambient)')
    parser.add_argument('--effect', action='append', default=[], metavar='NAME:PARAM=VALUE,...',
                        help='inject an effect of `ssi_ros effects`; may be repeated')
    parser.add_argument('--record-input', action='store_true',
                        help='write what drives it as well, each input that has a level: topics '
                        '/input/NAME, for --input of diagnose')
    parser.add_argument('--rate-hz', type=between(1e-6, 1e6),
                        help='sampling rate [Hz] (default: the configured one)')
    parser.add_argument('--at-rest', action='store_true',
                        help='start at rest in place of the stationary state')
    parser.add_argument('--start-s', type=float, default=1e9,
                        help='stamp of the first sample [s since 1970] (default: 1e9, September '
                        '2001: a fixed one, so that the same command makes the same bag)')


def run(args):
    """Simulate, write, say how fast it was."""
    from dataclasses import replace
    import math
    import time

    from ssi_ros.bag import write_samples
    from ssi_ros.bag.samples import input_channel
    from ssi_ros.cli._inputs import simulated_inputs
    from ssi_ros.cli._memory import check_memory
    from ssi_ros.cli._options import Progress, say_taken, warn
    from ssi_ros.quantity import things
    from ssi_ros.cli._outputs import check_room, make_room
    from ssi_ros.cli.model import chosen
    from ssi_ros.effects import inject, load_configuration, parse_effect, simulate_setup
    from ssi_ros.model import assemble, simulate

    if not (math.isfinite(args.start_s) and 0.0 <= args.start_s < 2 ** 31):
        raise ValueError(f'start_s={args.start_s:g} must be 0 to 2147483647 [s], the range of a '
                         'ROS time')
    check_room(args.bag, args.overwrite)
    begin = time.perf_counter()
    spacecraft, effects = load_configuration(args.config)
    say_taken(args.config)
    effects += tuple(parse_effect(e) for e in args.effect)
    warn([f'effect {e.name} is at the values that change nothing; give its size, such as '
          f'{e.name}:{e.size}=...' for e in effects if e.is_null])
    rate_hz = args.rate_hz or spacecraft.rate_hz
    check_memory(COPIES * 8.0 * len(assemble(spacecraft).channels) * rate_hz * args.duration_s,
                 f'{args.duration_s:g} s at {rate_hz:g} Hz')
    how, inputs = {'at_rest': args.at_rest, 'start_ns': round(args.start_s * 1e9)}, None
    with Progress('simulating') as progress:
        if effects:
            spacecraft = replace(spacecraft, rate_hz=args.rate_hz or spacecraft.rate_hz)
            if args.excitation != 'ambient':
                chosen(assemble(spacecraft), args.excitation)       # it is one of its own
                spacecraft = _with_excitation(spacecraft, args.excitation)
            setup = inject(spacecraft, effects, args.duration_s)
            samples = simulate_setup(setup, args.seed, progress=progress, **how)
            acting = assemble(spacecraft).excitation
        else:
            system = assemble(spacecraft)
            acting = chosen(system, args.excitation)
            samples = simulate(system, args.duration_s, args.seed, rate_hz=args.rate_hz,
                               excitation=acting, progress=progress, **how)
            setup = inject(replace(spacecraft, rate_hz=rate_hz), (), args.duration_s)
    if args.record_input:
        inputs = simulated_inputs(setup, acting, samples, args.seed)
    made = {'command': 'ssi_ros simulate', 'seed': args.seed, 'excitation': args.excitation,
            'config': args.config or 'packaged', 'effects': ' '.join(e.text() for e in effects)}
    make_room(args.bag)
    with Progress('writing') as progress:
        write_samples(args.bag, samples, inputs=inputs, extra=made, progress=progress)
    took = time.perf_counter() - begin
    channels = things(len(samples.channels), 'channel')
    print(f'{args.bag}: {len(samples.values)} samples of {channels} at {samples.rate_hz:g} Hz, '
          f'{samples.duration_s:g} s in {took:.2f} s '
          f'({samples.duration_s / took:.0f} times real time)')
    if inputs is not None:
        print('diagnose it with ' + ' '.join(
            '--input ' + ':'.join(input_channel(n)) for n in inputs.channels))
    return 0


def _with_excitation(spacecraft, name):
    """Return the spacecraft with only the excitation that a name of EXCITATIONS stands for."""
    from dataclasses import replace
    levels = {'ambient': {}, 'torque': {'process_noise_rms': 0.0},
              'process': {'torque_rms_n_m': (0.0, 0.0, 0.0)}}[name]
    return replace(spacecraft, excitation=replace(spacecraft.excitation, **levels))
