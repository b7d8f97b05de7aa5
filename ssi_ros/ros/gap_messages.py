"""Between a GapUpdate and messages; numbers are written so that they are read back to the bit."""
import json

from diagnostic_msgs.msg import DiagnosticArray
from ssi_ros.ros.messages import status, time_of
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

SURE = 0.01             # chance of the leading effect's score, above which it says little


def where_message(update):
    """Return window, sites, leading effect and alarm as DiagnosticArray, stamped by its end."""
    sites = update.sites or {}
    ranked = sorted(sites, key=lambda s: -sites[s])
    out = [status(
        'window', 'warn' if update.reason else 'ok',
        update.reason or f'{update.deviations:+.1f} sd above the floor', start_ns=update.start_ns,
        end_ns=update.end_ns, gap=float(update.value), floor=float(update.floor),
        floor_std=float(update.floor_std), deviations=float(update.deviations),
        reason=update.reason, levels=json.dumps(update.levels or {}))]
    out.append(status('site', 'ok', ', '.join(f'{s} {100 * sites[s]:.0f} %' for s in ranked),
                      **{s: float(sites[s]) for s in sites}))
    text = ('none stands out' if update.leading_p > SURE else
            f'{update.leading}: {update.leading_z:+.1f} sd')
    out.append(status('leading effect', 'ok', text, effect=update.leading,
                      template=update.leading_text, z=float(update.leading_z),
                      p_value=float(update.leading_p)))
    out.append(alarm_status('alarm', update))
    msg = DiagnosticArray(status=out)
    msg.header.stamp = time_of(update.end_ns)
    return msg


def sites_message(update):
    """Return the share of every site as numbers; the label names the sites, in this order."""
    sites = update.sites or {}
    layout = MultiArrayLayout(dim=[
        MultiArrayDimension(label=','.join(sites), size=len(sites), stride=len(sites)),
        MultiArrayDimension(label=f'window_end_ns={update.end_ns}', size=1, stride=1)])
    return Float64MultiArray(layout=layout, data=[float(v) for v in sites.values()])


def alarm_status(name, update, blind=''):
    """
    Return the alarm as a DiagnosticStatus: ERROR once it is raised, until it is reset.

    It is quiet only while it watches: STALE where `blind` says why not, or the newest hop of the
    update could not be measured, or there is no update yet.
    """
    raised = update is not None and update.raised_ns is not None
    if update is None or not update.measured:
        blind = blind or ('no hop has been measured yet' if update is None else
                          f'the newest hop was not measured ({update.reason})')
    level, text = 'ok', 'quiet'
    if raised:
        level, text = 'error', f'raised at {update.raised_ns * 1e-9:.3f} s by {update.cause}'
    if blind:
        level = 'error' if raised else 'stale'
        text = f'{text}; not watching now: {blind}' if raised else f'not watching: {blind}'
    return status(name, level, text, cause=update.cause if raised else '',
                  raised_ns=update.raised_ns if raised else -1,
                  log_evidence_over_threshold=float(
                      update.alarm_level if update is not None else '-inf'))


def numbers_of(msg):
    """Return what `where_message` wrote as dicts by status name; values are texts."""
    return {s.name: {v.key: v.value for v in s.values} for s in msg.status}
