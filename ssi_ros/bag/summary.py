"""What is in a bag, as plain data: topics, rates, gaps, size."""
import numpy as np

_GAP = 1.5            # an interval of so many median ones is a gap: a message or more is missing


def summarise(bag, progress=None):
    """
    Return what is in a bag, ready for JSON.

    Rates and gaps are those of the log times: a topic's median interval gives its rate, and an
    interval of more than 1.5 of it is a gap. Where messages were logged in bunches the mean
    interval gives the rate, and 1.5 of the longest usual one (99 %) is a gap.

    Parameters
    ----------
    bag : Bag
        An open bag; all of it is read.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    dict

    """
    logs = {t.name: [] for t in bag.topics}
    for done, (_, _, found) in enumerate(bag.pieces()):
        for name, (times, _, _) in found.items():
            logs[name].append(np.array(times, np.int64))
        if progress is not None:
            progress((done + 1) / len(bag.sources))
    return {
        'path': str(bag.path), 'files': [f.name for f in bag.files],
        'size_bytes': sum(f.stat().st_size for f in bag.files),
        'compression': list(bag.compressions), 'start_ns': bag.start_ns, 'end_ns': bag.end_ns,
        'duration_s': (bag.end_ns - bag.start_ns) / 1e9, 'messages': bag.message_count,
        'custom_data': dict(bag.custom_data),
        'topics': [{'name': t.name, 'type': t.type, 'messages': t.count, 'qos': list(t.qos),
                    'type_hash': t.type_hash, **_pace(logs[t.name])} for t in bag.topics]}


def _pace(parts):
    """Return rate and gaps of a topic's log times; None where there are too few messages."""
    times = np.sort(np.concatenate(parts)) if parts else np.empty(0, np.int64)
    steps = np.diff(times)
    if not len(steps) or times[-1] == times[0]:
        return {'rate_hz': None, 'gaps': 0, 'longest_gap_s': None, 'longest_gap_at_s': None}
    median, mean = float(np.median(steps)), float(np.mean(steps))
    usual = median
    if median < 0.5 * mean:           # in bunches, as /clock or a busy machine logs them
        median, usual = mean, max(mean, float(np.quantile(steps, 0.99)))
    longest = int(steps.argmax())
    gaps = int((steps > _GAP * usual).sum())
    return {'rate_hz': 1e9 / median, 'gaps': gaps,
            'longest_gap_s': steps[longest] / 1e9 if gaps else None,
            'longest_gap_at_s': (times[longest] - times[0]) / 1e9 if gaps else None}


def as_text(summary):
    """Return the summary as lines for the terminal."""
    mib = summary['size_bytes'] / 2 ** 20
    lines = [f'{summary["path"]}: {summary["messages"]} messages in {summary["duration_s"]:.2f} s,'
             f' {mib:.2f} MiB in {len(summary["files"])} file(s), compression '
             + (', '.join(summary['compression']) or 'none')]
    lines += [f'  {k}: {v}' for k, v in summary['custom_data'].items()]
    width = max((len(t['name']) for t in summary['topics']), default=0)
    for t in summary['topics']:
        rate = 'one or no message' if t['rate_hz'] is None else f'{t["rate_hz"]:.6g} Hz'
        line = f'{t["name"]:<{width}}  {t["type"]}  {t["messages"]} messages  {rate}'
        if t['gaps']:
            line += (f'  {t["gaps"]} gap(s), the longest {t["longest_gap_s"]:.3f} s at '
                     f'{t["longest_gap_at_s"]:.3f} s')
        lines.append(line)
    return '\n'.join(lines)
