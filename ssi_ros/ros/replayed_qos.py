"""The quality of service of a bag's publishers, as a bag of others may describe it."""
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

DEEPEST = 100_000         # samples of a queue that a bag may ask for


def publisher_qos(offered, reliable=False):
    """
    Return the quality of service that the bag's publishers offered; reliable if asked.

    Words and, in bags before ROS 2 Iron, numbers are known; what is neither is the default.
    """
    best_effort = not reliable and any(
        o.get('reliability') in ('best_effort', 2) for o in offered)
    latched = bool(offered) and all(
        o.get('durability') in ('transient_local', 1) for o in offered)
    depth = offered[0].get('depth') if offered else 0
    depth = depth if isinstance(depth, int) and 0 <= depth <= DEEPEST else 0
    if reliable and not latched:        # where its queue is full, `publish` waits and says so
        return QoSProfile(history=HistoryPolicy.KEEP_ALL, depth=1,
                          reliability=ReliabilityPolicy.RELIABLE)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=max(depth, 5000),
        reliability=(ReliabilityPolicy.BEST_EFFORT if best_effort
                     else ReliabilityPolicy.RELIABLE),
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE))
