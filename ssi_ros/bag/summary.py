"""What is in a bag, as plain data: topics, rates, gaps, size."""
import numpy as np

from ssi_ros.limits import LIMITS
from ssi_ros.quantity import shown, things

from .intervals import Intervals
from .play import stamp_shifter

MIXED = 0.05          # share of stamps that are doubled, or alternate, which is said
_HEAD = 12            # bytes of a message that hold its encapsulation and its stamp


def summarise(bag, progress=None):
    """
    Return what is in a bag, ready for JSON.

    Rates and gaps are those of the log times: a topic's median interval gives its rate, and an
    interval of more than 1.5 of it is a gap. Where messages were logged in bunches the mean
    interval gives the rate, and 1.5 of the longest usual one (99 %) is a gap. `stamp_gaps` and
    `stamps_missing` are those of the header stamps, where the type has one that is not 0: a sample
    that is missing shows there also where messages were logged in bunches. `stamps_doubled` have
    the stamp of another one, `stamps_by_turns` alternate between two steps: two publishers.

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
    logs, stamps = ({t.name: Intervals() for t in bag.topics} for _ in range(2))
    stamped = {t.name for t in bag.topics if stamp_shifter(t.type, t.definition) is not None}
    held = 0
    for done, (_, _, found) in enumerate(bag.pieces(most=_HEAD)):
        for name, (times, _, raws) in found.items():
            logs[name].add(np.array(times, np.int64))
            if name in stamped:
                stamps[name].add(_stamps(raws))
            held += 2 * len(times)
        if held > LIMITS.topic_samples:
            held = 0
            for intervals in (*logs.values(), *stamps.values()):
                intervals.fold()
        if progress is not None:
            progress((done + 1) / len(bag.sources))
    return {
        'path': str(bag.path), 'files': [f.name for f in bag.files],
        'size_bytes': sum(f.stat().st_size for f in bag.files),
        'compression': list(bag.compressions), 'start_ns': bag.start_ns, 'end_ns': bag.end_ns,
        'duration_s': (bag.end_ns - bag.start_ns) / 1e9, 'messages': bag.message_count,
        'custom_data': dict(bag.custom_data),
        'warnings': list(bag.warnings),
        'topics': [{'name': t.name, 'type': t.type, 'messages': t.count, 'qos': list(t.qos),
                    'type_hash': t.type_hash, **logs[t.name].pace(),
                    **stamps[t.name].missing()} for t in bag.topics]}


def _stamps(raws):
    """Return the times [ns] that CDR messages begin with; those too short to hold one are not."""
    raws = [raw for raw in raws if len(raw) == _HEAD]
    heads = b''.join(raw[4:] for raw in raws)
    order = '<' if raws and raws[0][1] else '>'
    time = np.frombuffer(heads, np.dtype([('sec', f'{order}i4'), ('nanosec', f'{order}u4')]))
    return time['sec'].astype(np.int64) * 1_000_000_000 + time['nanosec']


def _publishers(topic):
    """Return what speaks for several publishers of a topic, in words; empty where nothing does."""
    several = f', of {len(topic["qos"])} publishers' if len(topic['qos']) > 1 else ''
    most = MIXED * topic['messages']
    if (topic['stamps_doubled'] or 0) > most:
        return f'  {topic["stamps_doubled"]} with the stamp of another one{several}'
    if (topic['stamps_by_turns'] or 0) > most:
        return (f'  {topic["stamps_by_turns"]} by turns at two steps of their stamps, as of two '
                f'publishers{several}')
    return f'  {len(topic["qos"])} publishers when it was joined' if several else ''


def as_text(summary):
    """Return the summary as lines for the terminal."""
    mib = summary['size_bytes'] / 2 ** 20
    lines = [f'{summary["path"]}: {summary["messages"]} messages in {summary["duration_s"]:.2f} s,'
             f' {mib:.2f} MiB in {things(len(summary["files"]), "file")}, compression '
             + (', '.join(summary['compression']) or 'none')]
    lines += [shown(f'  {k}: {v or "none"}') for k, v in summary['custom_data'].items()]
    names = {t['name']: shown(t['name']) for t in summary['topics']}
    width = max((len(names[t['name']]) for t in summary['topics']), default=0)
    for t in summary['topics']:
        line = (f'{names[t["name"]]:<{width}}  {shown(t["type"])}  '
                f'{things(t["messages"], "message")}')
        if t['rate_hz'] is not None:
            line += f'  {t["rate_hz"]:.6g} Hz'
        if t['gaps']:
            line += (f'  {things(t["gaps"], "gap")} by receipt, the longest '
                     f'{t["longest_gap_s"]:.3f} s at {t["longest_gap_at_s"]:.3f} s')
        if t['stamps_missing']:
            line += (f'  {things(t["stamps_missing"], "sample")} missing by their stamps, in '
                     f'{things(t["stamp_gaps"], "gap")}')
        line += _publishers(t)
        lines.append(line)
    return '\n'.join(lines)
