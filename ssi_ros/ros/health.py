"""What the nodes report on /diagnostics: plain functions from counts to statuses."""
import math

from ssi_ros.ros.arrivals import RECENT
from ssi_ros.ros.gap_messages import alarm_status
from ssi_ros.ros.messages import clock_words, status
from ssi_ros.ros.mixed import mixed_words

RATE_TOLERANCE = 0.02       # a channel whose rate differs by more is at another rate,
RECEIPT_TOLERANCE = 0.2     # and if it is stamped by receipt, whose times are uneven, by this
LOST_MOST = 0.5             # share of lost samples that is an error
DOUBLED_MOST = 0.1          # share of samples with the stamp of another one that is reported


def identifier(node, states, worker, jumps):
    """Return the statuses of the identifier: one a channel, one for the identification."""
    return [channel(node, s) for s in states] + [_identification(node, states, worker, jumps)]


def known(number):
    """Return a number, or no text where it is not known yet: no nan or inf in a diagnostic."""
    return float(number) if math.isfinite(number) else ''


def channel(node, state):
    """Return the status of one channel: what arrives now, at which rate, what is missing."""
    level, text = _judged(state)
    source, count = state.source, state.count
    return status(
        f'{node}: channel {source.name}', level, text, topic=source.resolved, field=source.field,
        rate_hz=0.0 if state.silent_s else known(count.rate_hz), silent_s=float(state.silent_s),
        lost_lately=state.lost, lost_share_lately=float(state.lost_share),
        received=count.received, missing=count.missing, late=count.late,
        duplicates=count.duplicates, out_of_order=count.out_of_order,
        not_finite=count.not_finite, bad_stamps=count.bad_stamps, off_rate=count.off_rate,
        unreadable=source.unreadable, longest_gap_s=float(count.longest_gap_s),
        publishers=state.publishers, mixed=state.left_out, offset_s=known(state.offset_s))


def _judged(state):
    return _mixed(state) or _silence(state) or _fault(state) or _losses(state)


def useless_words(states):
    """Return which channels bring nothing that can be used, and why; empty where all do."""
    bad = [s for s in states if (s.count.received or s.mixed) and _judged(s)[0] == 'error']
    if not bad:
        return ''
    quiet = [s for s in bad if s.silent_s]
    if len(quiet) == len(states):
        return f'no sample for {max(s.silent_s for s in quiet):.0f} s'
    words = [f'no sample of {", ".join(s.source.name for s in quiet)} for '
             f'{max(s.silent_s for s in quiet):.0f} s'] if quiet else []
    if other := [s.source.name for s in bad if not s.silent_s]:
        words.append(f'no usable sample of {", ".join(other)}')
    return '; '.join(words)


def _mixed(state):
    """Return level and text where several publishers send at once."""
    if not state.mixed:
        return None
    return 'error', (f'{mixed_words(state.source.resolved, state.publishers)}; '
                     f'{state.left_out} samples left out')


def _silence(state):
    """Return level and text where no message comes."""
    source, n = state.source, state.publishers
    if state.count.received and not state.silent_s:
        return None
    if state.silent_s:
        level, text = 'error', f'silent for {state.silent_s:.0f} s: '
    else:
        level, text = 'warn' if state.up_s < 5.0 else 'error', 'silent: '
    if n == 0:
        return level, text + f'no publisher of {source.resolved} [{source.type}]'
    if state.other_types:
        return 'error', text + (
            f'{source.resolved} is published as {", ".join(state.other_types)}, and read as '
            f'{source.type}; correct the type of the channel')
    return level, text + (
        f'{n} publisher(s) of {source.resolved}, but no message arrives; compare type and QoS (a '
        'best-effort publisher and a reliable subscriber never connect)')


def _fault(state):
    """Return level and text of what makes a channel useless or doubtful."""
    source, rate, grid = state.source, state.count.rate_hz, state.grid_rate_hz
    if state.off_rate:
        return 'error', (f'arrives at {rate:.2f} Hz, the grid is at {grid:.2f} Hz: its samples '
                         'are left out')
    tolerance = RECEIPT_TOLERANCE if source.by_receive_time else RATE_TOLERANCE
    if grid and abs(rate / grid - 1.0) > tolerance:
        return 'error', (f'arrives at {rate:.2f} Hz, the grid is at {grid:.2f} Hz: windows of it '
                         'are refused')
    if state.runs_away:
        return 'error', 'its clock runs away from that of the first channel'
    if state.doubled > DOUBLED_MOST:
        return ('error' if state.doubled > LOST_MOST else 'warn',
                f'{100 * state.doubled:.3g} % of the samples have the stamp of another one')
    if state.other_types:
        return 'warn', (f'somebody publishes {", ".join(state.other_types)} on {source.resolved}, '
                        f'which is read as {source.type}: that is not heard')
    if state.publishers > 1:
        return 'warn', f'{state.publishers} publishers on one topic: where both send, samples mix'
    if source.by_receive_time and state.lost_share < LOST_MOST:
        return 'warn', 'stamped by the time of receipt: the header has no stamp'
    return None


def _losses(state):
    """Return level and text of a channel that arrives: its rate, and what it lost lately."""
    count, lately = state.count, state.lately
    text = ('no rate yet' if math.isnan(count.rate_hz) else f'{count.rate_hz:.2f} Hz')
    if state.lost:
        parts = {'not finite': lately.not_finite, 'stamps of no use': lately.bad_stamps,
                 'late': lately.late}
        more = ', '.join(f'{n} {word}' for word, n in parts.items() if n)
        return ('error' if state.lost_share > LOST_MOST else 'warn',
                f'{text}, {state.lost} samples lost in the last {RECENT} s '
                f'({100 * state.lost_share:.3g} %)' + (f': {more}' if more else ''))
    before = count.missing + count.late + count.not_finite + count.bad_stamps
    if before:
        text += f'; {before} samples lost before'
    if state.source.unreadable:
        return 'warn', text + f'; {state.source.unreadable} messages could not be read'
    return ('warn' if math.isnan(count.rate_hz) and state.up_s > 5.0 else 'ok'), text


def _all_useless(states):
    return all(_judged(s)[0] == 'error' for s in states)


def _identification(node, states, worker, jumps):
    hop_s, grid = worker.identification.hop_s, worker.grid
    fill = worker.follow.fill
    margin = hop_s / worker.compute_s if worker.compute_s > 0.0 else float('inf')
    last = worker.last
    level, text = 'ok', f'window {100.0 * fill:.0f} % full'
    if last is not None and last.reason:
        level = 'warn'
        text = f'{len(last.modes)} modes; {last.reason}' if last.modes else last.reason
    elif last is not None:
        text = f'{len(last.modes)} modes'
    if quiet := useless_words(states):
        level = 'error' if _all_useless(states) else 'warn'
        text = quiet + ('' if last is None else
                        f'; the last window, to {clock_words(last.end_ns)}: {text}')
    elif margin < 1.0:
        level, text = 'error', (f'{worker.compute_s:.2f} s a window is more than the hop of '
                                f'{hop_s:g} s: raise hop_s or lower order_max')
    if worker.rows.skips_lately(worker.identification.window_s):
        level = 'error' if level == 'error' else 'warn'
        text += f'; {worker.rows.skipped} windows skipped, as this machine is too slow for all'
    return status(
        f'{node}: identification', level, text, grid_rate_hz=float(grid.rate_hz),
        window_fill=float(fill), windows=worker.computed, compute_s=float(worker.compute_s),
        compute_worst_s=float(worker.worst_s), real_time_margin=known(margin),
        modes=0 if last is None else len(last.modes), rows_waiting=worker.rows.waiting,
        windows_skipped=worker.rows.skipped, clock_jumps=jumps)


def meter(node, states, worker, preparation, background):
    """Return the statuses of the gap meter: its windows, and its alarm."""
    last, level, text = worker.last, 'ok', 'no whole hop yet'
    quiet = useless_words(states)
    if worker.fault:
        level, text = 'error', worker.fault
    elif worker.model is None:
        level, text = 'warn', f'preparing, {100 * preparation.share:.0f} %'
    elif last is not None:
        level = 'warn' if last.reason else 'ok'
        text = last.reason or f'{last.deviations:+.1f} sd above the floor'
    blind = worker.fault or ('the meter is not prepared yet' if worker.model is None else '')
    if quiet:
        level = 'error' if level == 'error' or _all_useless(states) else 'warn'
        text = quiet + ('' if last is None else
                        f'; the last window, to {clock_words(last.end_ns)}: {text}')
        blind = quiet
    doing = f'{100 * background.share:.0f} %' if background.busy else 'none'
    return [status(f'{node}: gap', level, text, updates=worker.updates, diagnosis=doing,
                   compute_s=float(worker.compute_s), rows_waiting=worker.rows.qsize(),
                   load=float(worker.compute_s / worker.settings.hop_s)),
            alarm_status(f'{node}: alarm', last, blind)]
