"""What the nodes report on /diagnostics: plain functions from counts to statuses."""
from ssi_ros.ros.messages import status

RATE_TOLERANCE = 0.02       # a channel whose rate differs by more is at another rate,
RECEIPT_TOLERANCE = 0.2     # and if it is stamped by receipt, whose times are uneven, by this


def identifier(node, sources, publishers, worker, up_s):
    """Return the statuses of the identifier: one a channel, one for the identification."""
    grid = worker.grid
    out = [channel(node, source, n, grid.counts[i], grid.rate_hz, up_s)
           for i, (source, n) in enumerate(zip(sources, publishers))]
    out.append(_identification(node, grid, worker, up_s))
    return out


def channel(node, source, publishers, count, grid_rate_hz, up_s):
    """Return the status of one channel: what arrives, at which rate, what is missing."""
    level, text = 'ok', f'{count.rate_hz:.2f} Hz'
    lost = count.missing + count.late
    tolerance = RECEIPT_TOLERANCE if source.by_receive_time else RATE_TOLERANCE
    if count.received == 0:
        level = 'warn' if up_s < 5.0 else 'error'
        text = (f'silent: no publisher of {source.resolved} [{source.type}]'
                if publishers == 0 else
                f'silent: {publishers} publisher(s) of {source.resolved}, but no message arrives; '
                'compare type and QoS (a best-effort publisher and a reliable subscriber never '
                'connect)')
    elif grid_rate_hz and abs(count.rate_hz / grid_rate_hz - 1.0) > tolerance:
        level, text = 'error', (f'arrives at {count.rate_hz:.2f} Hz, the grid is at '
                                f'{grid_rate_hz:.2f} Hz: windows of it are refused')
    elif publishers > 1:
        level, text = 'warn', f'{publishers} publishers on one topic: their samples are mixed'
    elif source.by_receive_time:
        level, text = 'warn', 'stamped by the time of receipt: the header has no stamp'
    elif lost or count.not_finite or count.bad_stamps or source.unreadable:
        level, text = 'warn', f'{lost} samples lost, {count.not_finite} not finite'
    return status(
        f'{node}: channel {source.name}', level, text, topic=source.resolved, field=source.field,
        rate_hz=float(count.rate_hz), received=count.received, missing=count.missing,
        late=count.late, duplicates=count.duplicates, out_of_order=count.out_of_order,
        not_finite=count.not_finite, bad_stamps=count.bad_stamps, unreadable=source.unreadable,
        longest_gap_s=float(count.longest_gap_s), publishers=publishers)


def _identification(node, grid, worker, up_s):
    hop_s = worker.identification.hop_s
    fill = worker.follow.fill
    margin = hop_s / worker.compute_s if worker.compute_s > 0.0 else float('inf')
    last = worker.last
    level, text = 'ok', f'window {100.0 * fill:.0f} % full'
    if last is not None and last.reason:
        level, text = 'warn', last.reason
    elif last is not None:
        text = f'{len(last.modes)} modes'
    if margin < 1.0:
        level, text = 'error', (f'{worker.compute_s:.2f} s a window is more than the hop of '
                                f'{hop_s:g} s: raise hop_s or lower order_max')
    return status(
        f'{node}: identification', level, text, grid_rate_hz=float(grid.rate_hz),
        window_fill=float(fill), windows=worker.computed, compute_s=float(worker.compute_s),
        compute_worst_s=float(worker.worst_s), real_time_margin=float(margin),
        modes=0 if last is None else len(last.modes), rows_waiting=worker.rows.qsize(),
        clock_jumps=len(grid.jumps))
