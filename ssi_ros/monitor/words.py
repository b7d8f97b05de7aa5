"""A watch as lines of text: modes with trends, a sketch over windows, the gap, health."""
import math

from ssi_ros.monitor.watch import histories
from ssi_ros.quantity import with_spread

BARS = '▁▂▃▄▅▆▇█'
MARKS = {'structural': '●', 'undecided': '○', 'input_line': '◆'}
LEVELS = {'ok': 'ok   ', 'warn': 'WARN ', 'error': 'ERROR', 'stale': 'STALE'}
RANK = {'error': 0, 'stale': 1, 'warn': 2, 'ok': 3}
TREND = 16              # windows of a sparkline
# Spreads that a mode must have moved for an arrow. On 40 simulated records without drift (20
# modes, 900 s, windows of 120 s) 0.9 % of 1000 screens had one; two spreads gave 83 %, for the
# estimated spreads scatter, and twenty modes have twenty chances: validation.monitor_arrows.
SURE = 5.0


def sparkline(values, low=None, high=None):
    """Return values as a row of bars between their least and greatest; a gap where missing."""
    known = [v for v in values if v is not None and math.isfinite(v)]
    if not known:
        return ' ' * len(values)
    low = min(known) if low is None else low
    span = (max(known) if high is None else high) - low

    def bar(v):
        if v is None or not math.isfinite(v):
            return ' '
        share = (v - low) / span if span > 0 else 0.5
        return BARS[min(len(BARS) - 1, max(0, int(share * len(BARS))))]
    return ''.join(map(bar, values))


def arrow(history):
    """Return ↑ or ↓ if a frequency has left its spread since the first window shown, else →."""
    seen = [m for m in history if m is not None]
    first, last = seen[0], seen[-1]
    spread = math.hypot(first.frequency_std_hz, last.frequency_std_hz)
    if not math.isfinite(spread) or abs(last.frequency_hz - first.frequency_hz) <= SURE * spread:
        return '→'
    return '↑' if last.frequency_hz > first.frequency_hz else '↓'


def mode_lines(watch):
    """Return the table of modes."""
    head = f'{"id":>4} {"frequency [Hz]":>20} {"damping [%]":>15}  {"trend":<{TREND + 2}} label'
    lines = [head]
    for identity, history in histories(watch.windows).items():
        m = next(m for m in reversed(history) if m is not None)
        missed = next(k for k, seen in enumerate(reversed(history)) if seen is not None)
        recent = history[-TREND:]
        # never less than three spreads high: chance alone looks flat
        reach = 3.0 * m.frequency_std_hz if math.isfinite(m.frequency_std_hz) else 0.0
        f = [h.frequency_hz for h in recent if h is not None] + [
            m.frequency_hz - reach, m.frequency_hz + reach]
        trend = sparkline([None if h is None else h.frequency_hz for h in recent],
                          min(f), max(f))
        label = f'{MARKS[m.label]} {m.label.replace("_", " ")}'
        if missed:
            label = f'{MARKS[m.label]} missing for {missed}'
        f = with_spread(m.frequency_hz, m.frequency_std_hz, 4, '±')
        damping = with_spread(100 * m.damping_ratio, 100 * m.damping_ratio_std, 2, '±')
        lines.append(f'{identity:>4} {f:>20} {damping:>15}  '
                     f'{arrow(recent) if any(recent) else " "} {trend:<{TREND}} {label}')
    if len(lines) == 1:
        lines.append('     ' + (watch.windows[-1].reason or 'no modes' if watch.windows else
                                'no window yet: is an identifier running, and its window full?'))
    return lines


def sketch_lines(watch, columns=72, rows=10):
    """
    Return a stabilisation sketch: a row a window, the latest on top, marks at the modes.

    What stays in its column is a mode; the axis is logarithmic.
    """
    windows = watch.windows[-rows:]
    f = [m.frequency_hz for w in windows for m in w.modes]
    if not f:
        return ['nothing to draw yet']
    low, high = 0.9 * min(f), 1.1 * max(f)

    def column(frequency_hz):
        return int((columns - 1) * math.log(frequency_hz / low) / math.log(high / low))
    lines = []
    for w in reversed(windows):
        row = [' '] * columns
        for m in w.modes:
            row[column(m.frequency_hz)] = MARKS[m.label]
        lines.append(''.join(row) + f'│ {len(w.modes)}')
    axis = ['─'] * columns
    words = [' '] * (columns + 8)
    for tick in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000):
        if low < tick < high:
            axis[column(tick)] = '┬'
            words[column(tick):column(tick) + len(f'{tick:g}')] = f'{tick:g}'
    return lines + [''.join(axis) + '┘ modes', ''.join(words).rstrip() + ' Hz']


def gap_lines(watch):
    """Return the gap meter, its site and leading effect."""
    if not watch.gap and not watch.where:
        return ['no gap node is heard (ros2 run ssi_ros gap_node)']
    lines = []
    if watch.gap:
        floor = watch.floor[-1] if watch.floor else math.nan
        known = f', floor {floor:.4f}' if math.isfinite(floor) else ''
        deviations = f', {watch.deviations[-1]:+.1f} sd' if watch.deviations else ''
        lines.append(f'gap {watch.gap[-1]:.4f} nats{known}{deviations}')
        lines.append(sparkline(watch.gap[-40:], low=min([floor, *watch.gap[-40:]])
                               if math.isfinite(floor) else None))
    lines += [line for s in watch.where for line in _status(s)]
    return lines


def health_lines(watch):
    """Return the health of every channel and node, what is not well first."""
    if not watch.health:
        return ['nothing on /diagnostics yet']
    return [line for s in _worst_first(watch) for line in _status(s)]


def _worst_first(watch):
    return sorted(watch.health.values(), key=lambda s: (RANK[s.level], s.name))


def _status(status):
    return [f'{LEVELS[status.level]} {status.name}: {status.text}']


def summary_line(watch):
    """Return gap and health as one line: what is worst, and how much is well."""
    gap = f'gap {watch.deviations[-1]:+.1f} sd' if watch.deviations else 'no gap node'
    if not watch.health:
        return f'{gap}; nothing on /diagnostics yet'
    worst = _worst_first(watch)[0]
    if worst.level == 'ok':
        return f'{gap}; health: all {len(watch.health)} ok'
    return f'{gap}; {_status(worst)[0]}'


def head_line(watch, now_s):
    """Return one line: which window, how many modes, how long ago anything was heard."""
    if not math.isfinite(watch.heard_s):
        return 'nothing heard yet'
    age_s = now_s - watch.heard_s
    silent = f'   SILENT for {age_s:.0f} s' if age_s > 5.0 else ''
    if not watch.windows:
        return f'no window yet{silent}'
    w = watch.windows[-1]
    reason = f'   {w.reason}' if w.reason else ''
    return (f'window of {(w.end_ns - w.start_ns) * 1e-9:g} s ending at {w.end_ns * 1e-9:.1f} s, '
            f'{len(w.modes)} modes{reason}{silent}')


def text(watch, now_s):
    """Return everything as one text, for a terminal that cannot move its cursor, or a log."""
    parts = [[head_line(watch, now_s)], mode_lines(watch), sketch_lines(watch),
             gap_lines(watch), health_lines(watch)]
    return '\n\n'.join('\n'.join(p) for p in parts)
