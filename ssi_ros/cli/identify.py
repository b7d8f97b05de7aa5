"""
Identify frequencies and damping of a recorded bag on sliding windows.

The same code as the identifier node, on the same samples: the same numbers to the last bit. Any
bag with numeric fields will do, also one that never saw this package.

Methods: ssi_cov and ssi_data need ambient vibration; era needs a free decay, the response to a
pulse (begin behind it with --start-s); okid needs the recorded input (--input), such as a torque.
era and okid tell no spreads; all but ssi_cov need every sample.
"""
from pathlib import Path

from ssi_ros.whole_file import write_whole

HELP = 'frequencies and damping of a bag, on sliding windows'
EXAMPLE = 'ssi_ros identify bags/quiet --window-s 60 --hop-s 10 --json -'
JUMPS_SHOWN = 10          # jumps of the clock that are printed one by one


def add_arguments(parser):
    """Declare the options."""
    from ssi_ros.cli._options import add_quantities, add_scale, between
    from ssi_ros.identify.settings import Identification, METHODS
    parser.add_argument('bag', type=Path, metavar='BAG', help='folder of the bag, or its .mcap')
    parser.add_argument('--channel', action='append', metavar='TOPIC[:FIELD]',
                        help='a numeric field to use, repeatable (default: accel.linear.z of '
                        'every AccelStamped topic)')
    parser.add_argument('--method', choices=METHODS, default='ssi_cov',
                        help='ssi_cov (covariances), ssi_data (projections of the samples), era '
                        '(free decay), okid (recorded input) (default: ssi_cov)')
    parser.add_argument('--input', action='append', metavar='TOPIC[:FIELD]',
                        help='with okid: a recorded input, repeatable')
    parser.add_argument('--start-s', type=between(0, 1e10), default=0.0,
                        help='leave out what comes before, counted from the first stamp [s] '
                        '(default: 0)')
    parser.add_argument('--rate-hz', type=between(0, 1e6), default=0.0,
                        help='sampling rate [Hz] (default: estimated from the stamps)')
    parser.add_argument('--lateness-s', type=between(0, 3600), default=1.0,
                        help='how late a sample may come [s] (default: 1)')
    parser.add_argument('--json', metavar='FILE', help='write all windows, - for the terminal')
    parser.add_argument('--plot', type=Path, metavar='FOLDER', help='write the plots there')
    parser.add_argument('--explain', type=between(0, 1e6), metavar='HZ',
                        help='say what became of the poles near this frequency [Hz]')
    parser.add_argument('--band', metavar='LOW:HIGH',
                        help='only the modes between two frequencies [Hz], such as 5:20 or 5:')
    parser.add_argument('--modes', type=Path, metavar='FILE',
                        help='write the modes of the last window: .csv, or .uff or .unv, a '
                        'universal file with data sets 55 (needs pyuff)')
    parser.add_argument('--picks', type=Path, metavar='FILE',
                        help='take the poles that were picked and saved on the page of --plot, '
                        'in every window, in place of those that stabilise')
    parser.add_argument('--efdd', action='store_true',
                        help='compare the modes of the last window with enhanced frequency domain '
                        'decomposition')
    add_scale(parser)
    add_quantities(parser, Identification)


def run(args):
    """Identify, print the last window, write what was asked for; 1 when there are no modes."""
    import json
    import sys

    from ssi_ros.bag import parse_channel
    from ssi_ros.cli._colour import coloured
    from ssi_ros.cli._modes import check_modes, in_band, parse_band, scaled, write_modes
    from ssi_ros.cli._options import Progress, read_quantities
    from ssi_ros.identify import Identification, Method
    from ssi_ros.identify.modes_json import modes_json
    from ssi_ros.identify.picks import load_picks
    from ssi_ros.identify.stamped import identify_stamped

    settings = read_quantities(args, Identification)
    band = parse_band(args.band) if args.band else None
    check_modes(args.modes)
    inputs = [parse_channel(c) for c in args.input or ()]
    method = Method(args.method, tuple(c.name for c in inputs),
                    load_picks(args.picks) if args.picks else ())
    with Progress('reading') as progress:
        channels = [parse_channel(c) for c in args.channel] if args.channel else None
        recording = _read(args.bag, channels, inputs, progress)
    recording = scaled(recording, args.scale)
    first_ns = min((int(s[0]) for s in recording.stamps_ns if len(s)), default=0)
    if args.start_s:
        recording = _begun(recording, args.start_s, first_ns)
    with Progress('identifying') as progress:
        windows, grid = identify_stamped(
            recording.names, recording.stamps_ns, recording.values, settings,
            arrivals_ns=recording.arrivals_ns, rate_hz=args.rate_hz, lateness_s=args.lateness_s,
            progress=progress, method=method)
    if band:
        windows = in_band(windows, *band)
    names = recording.names[:len(recording.names) - len(inputs)]
    if args.json:
        text = json.dumps(modes_json(windows, first_ns), allow_nan=False)
        if args.json == '-':
            print(text)
        else:
            write_whole(args.json, text)
    out = sys.stderr if args.json == '-' else sys.stdout
    print(coloured(_summary(windows, grid, recording.names, method, first_ns), out), file=out)
    if args.modes:
        write_modes(args.modes, windows[-1], names)
    if not (grid.jumps or grid.turns):
        say_offsets(recording, names, windows, grid.rate_hz)
    if args.explain is not None:
        from ssi_ros.identify.explain import explain
        print(explain(windows[-1], args.explain), file=out)
    if args.efdd:
        print(_compared(windows[-1], recording, len(names), grid.rate_hz), file=out)
    if args.plot:
        with Progress('drawing'):
            paths = _draw(args, windows, names, recording, grid.rate_hz)
        for path in paths:
            print(f'wrote {path}', file=out)
    return 0 if any(w.modes for w in windows) else 1


def _draw(args, windows, names, recording, rate_hz):
    """Write the pictures and the page; return their paths."""
    import shlex

    from ssi_ros.cli._options import typed
    from ssi_ros.identify.plot_tracks import thinned
    from ssi_ros.identify.plots import spectrum_of, write_plots
    from ssi_ros.report.identification_page import identification_page
    spectrum = spectrum_of(windows[-1], recording.stamps_ns[:len(names)],
                           recording.values[:len(names)], rate_hz)
    paths = write_plots(windows, args.plot, names, spectrum)
    command = 'ssi_ros identify ' + shlex.join(typed(args, add_arguments, ('plot', 'picks')))
    paths.append(args.plot / 'index.html')
    write_whole(paths[-1], identification_page(
        args.bag.name, thinned(windows), names, spectrum, total=len(windows), command=command))
    return paths


def _compared(window, recording, count, rate_hz):
    """Return the modes of a window beside those of frequency domain decomposition, as text."""
    from ssi_ros.identify.efdd import efdd, efdd_table
    from ssi_ros.identify.plots import rows_of
    if not window.modes:
        return 'enhanced frequency domain decomposition: no mode to compare'
    rows = rows_of(window, recording.stamps_ns[:count], recording.values[:count], rate_hz)
    return ('enhanced frequency domain decomposition of the last window:\n'
            + efdd_table(window.modes, efdd(rows, rate_hz, window.modes)))


def say_offsets(recording, names, windows, rate_hz):
    """Warn of channels that are sampled beside the first one."""
    from ssi_ros.cli._options import warn
    from ssi_ros.identify.offsets import offsets, words
    found = offsets(recording.stamps_ns[:len(names)], rate_hz, windows[0].start_ns,
                    windows[-1].end_ns)
    warn(words(found, names, rate_hz))


def _read(path, channels, inputs, progress):
    """Read the channels, all accelerometers where none is named, and the inputs behind them."""
    from ssi_ros.bag import find_channels, open_bag, read_channels
    from ssi_ros.cli._mixed import check_publishers
    from ssi_ros.cli._options import warn
    bag, taken = open_bag(path), {(c.topic, c.field) for c in inputs}
    warn(bag.warnings)
    if channels is None:
        channels = find_channels(bag)
        silent = [t.name for t in bag.topics if t.type == channels[0].type and not t.count]
        warn([f'{name} has no message and is left out' for name in silent])
    channels = [c for c in channels if (c.topic, c.field) not in taken]
    recording = read_channels(bag, [*channels, *inputs], progress)
    check_publishers(bag, recording)
    return recording


def _begun(recording, start_s, first_ns):
    """Return the samples of a recording that are stamped at a time after the first, or later."""
    from dataclasses import replace
    later = [s >= first_ns + round(start_s * 1e9) for s in recording.stamps_ns]
    if not any(keep.any() for keep in later):
        end_s = (max(int(s.max()) for s in recording.stamps_ns if len(s)) - first_ns) * 1e-9
        raise ValueError(f'start_s={start_s:g} is beyond the record, which ends at {end_s:g} s')
    return replace(recording, **{
        name: tuple(part[keep] for part, keep in zip(getattr(recording, name), later))
        for name in ('stamps_ns', 'values', 'arrivals_ns')})


def _summary(windows, grid, names, method, first_ns):
    from ssi_ros.cli._table import mode_table
    from ssi_ros.quantity import things
    lines = []
    for name, count in zip(names, grid.counts):
        faults = {k: getattr(count, k) for k in
                  ('missing', 'late', 'duplicates', 'out_of_order', 'not_finite', 'bad_stamps')}
        if any(faults.values()):
            lines.append(f'{name}: ' + ', '.join(f'{v} {k}' for k, v in faults.items() if v))
        if count.off_rate:
            lines.append(f'{name}: {count.off_rate} of {count.received} samples do not come at '
                         f'the rate of the grid (in the end {count.rate_hz:.5g} Hz) and are left '
                         'out')
    for old, new in grid.jumps[:JUMPS_SHOWN]:
        lines.append(f'the clock jumped by {(new - old) * 1e-9:+.3f} s at '
                     f'{(old - first_ns) * 1e-9:.1f} s: a new window began there')
    if len(grid.jumps) > JUMPS_SHOWN:
        lines.append(f'the clock jumped {len(grid.jumps)} times in all')
    for at, name in grid.turns[:JUMPS_SHOWN]:
        lines.append(f'the rate of {name} changed before {(at - first_ns) * 1e-9:.1f} s: a new '
                     'window began there')
    refused = [w for w in windows if not w.modes]
    names = names[:len(names) - len(method.inputs)]
    by = '' if method.name == 'ssi_cov' else f', {method.name}' + (
        f' with the input {", ".join(method.inputs)}' if method.inputs else '')
    lines.append(f'{things(len(names), "channel")} at {grid.rate_hz:g} Hz{by}, '
                 f'{things(len(windows), "window")}, '
                 f'{len(refused)} without modes')
    for w in windows[:-1]:
        if getattr(w, 'splits', ()) or getattr(w, 'merges', ()):
            lines.append(f'window to {(w.end_ns - first_ns) * 1e-9:.1f} s: {w.reason}')
    last = windows[-1]
    where = f'{(last.start_ns - first_ns) * 1e-9:.1f} to {(last.end_ns - first_ns) * 1e-9:.1f} s'
    if last.modes:
        lines.append(f'last window, {where}:\n{mode_table(last, names)}')
    if last.reason:
        lines.append(f'last window, {where}: {last.reason}')
    return '\n'.join(lines)
