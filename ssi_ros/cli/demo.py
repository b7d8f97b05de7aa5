"""
Run the whole chain once and compare: live modes, replayed modes, offline modes, theory.

Four processes (simulator, identifier, recorder, watcher) talk over DDS on this machine alone,
then the recorded bag is played to a second identifier and read offline.
"""
from pathlib import Path

from ssi_ros.whole_file import write_whole

HELP = 'simulate, identify live, record to MCAP, replay, compare'
EXAMPLE = 'ssi_ros demo --duration-s 420 --speed 10'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('--folder', type=Path, default=Path('demo'),
                        help='where bag, logs and modes.json go (default: demo)')
    parser.add_argument('--duration-s', type=float, default=420.0,
                        help='length of the simulation [s] (default: 420)')
    parser.add_argument('--window-s', type=float, default=360.0,
                        help='length of the window [s] (default: 360)')
    parser.add_argument('--hop-s', type=float, default=10.0,
                        help='time between two results [s] (default: 10)')
    parser.add_argument('--speed', type=float, default=10.0,
                        help='simulated seconds a second (default: 10)')
    parser.add_argument('--seed', type=int, default=1, help='seed (default: 1)')


def run(args):
    """Run the demo, print the table; 0 if all held."""
    import json
    import sys

    from ssi_ros.bag import read_channels
    from ssi_ros.cli._colour import coloured
    from ssi_ros.cli._options import Progress
    from ssi_ros.cli._table import compare, largest_difference
    from ssi_ros.identify import Identification
    from ssi_ros.identify.modes_json import modes_json
    from ssi_ros.identify.stamped import identify_stamped
    from ssi_ros.model import assemble, load_spacecraft, natural_modes
    from ssi_ros.ros import demo

    settings = Identification(window_s=args.window_s, hop_s=args.hop_s)
    if args.duration_s < args.window_s:
        raise ValueError(f'duration_s={args.duration_s:g} is shorter than the window of '
                         f'{args.window_s:g} s; make it longer, or the window shorter')
    _make_room(args.folder)
    with Progress('demo') as progress:
        outcome = demo.run(args.folder, duration_s=args.duration_s, window_s=args.window_s,
                           hop_s=args.hop_s, speed=args.speed, seed=args.seed,
                           say=progress.say, progress=progress)
    print(f'step 3 of 3, offline: the verb `identify` on {outcome.bag}')
    recording = read_channels(outcome.bag)
    with Progress('offline') as progress:
        offline, _ = identify_stamped(recording.names, recording.stamps_ns, recording.values,
                                      settings, arrivals_ns=recording.arrivals_ns,
                                      progress=progress)
    write_whole(args.folder / 'modes.json', json.dumps(
        modes_json(outcome.live.values(), int(recording.stamps_ns[0][0]))))
    theory = natural_modes(assemble(load_spacecraft()))
    last = outcome.live[max(outcome.live)]
    found, text = compare(theory, 20, last)
    print(coloured(f'\n{args.window_s:g} s window, live over DDS, against theory:\n{text}',
                   sys.stdout))
    replay = largest_difference(outcome.live, outcome.replayed)
    alone = largest_difference(outcome.live, {w.end_ns: w for w in offline})
    print(f'\n{found} of 20 modes within 0.5 % of their own line of theory, paired by frequency '
          'and shape '
          f'({sum(m.label == "structural" for m in last.modes)} found structural)')
    print(f'replayed against live, {len(outcome.replayed)} windows: '
          f'largest difference {replay:.1e}')
    print(f'offline against live, {len(offline)} windows: largest difference {alone:.1e}')
    print(f'live {outcome.live_s:.0f} s, replay {outcome.replay_s:.0f} s; bag: {outcome.bag}, '
          f'modes: {args.folder / "modes.json"}')
    print(f'go on with: ssi_ros info {outcome.bag}')
    good = found >= 18 and replay <= 1e-9 and alone <= 1e-9
    return 0 if good else 1


def _make_room(folder):
    """Make the folder, or clear it if it is that of an earlier demo; never anybody else's."""
    import shutil
    mark = folder / '.ssi_ros_demo'
    if folder.exists() and any(folder.iterdir()) and not mark.exists():
        raise ValueError(f'{folder} holds files that are not of a demo; name another --folder')
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    mark.touch()
