"""Is what is on the ROS graph right? Names, quality of service, clocks, rates, stamps."""
from collections import Counter, deque
import time

import numpy as np
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_check_compatible, QoSCompatibility
from rclpy.signals import SignalHandlerOptions
from ssi_ros.bag.cdr import field_reader
from ssi_ros.bag.definitions import definition_of
from ssi_ros.quantity import things
from ssi_ros.ros.channels import message_class
from ssi_ros.ros.doctor import Finding
from ssi_ros.ros.recorder_node import adapted_qos

SENSORS = {'geometry_msgs/msg/AccelStamped': 'accel.linear.z',
           'sensor_msgs/msg/Imu': 'linear_acceleration.z'}
LEAST_S, QUIET_S, MOST_S = 4.0, 1.5, 10.0   # discovery: some nodes come with the next round only
ANSWER_S = 1.5
OFFSET_S = 1.0            # a stamp that is farther from now belongs to another clock
NAME = 'ssi_ros_doctor'


def graph(seconds):
    """
    Return the findings on the ROS graph.

    Parameters
    ----------
    seconds : float
        How long sensor topics are listened to [s].

    Returns
    -------
    list of Finding

    Raises
    ------
    ValueError
        If `seconds` is not positive.

    """
    if not seconds > 0.0:
        raise ValueError(f'seconds={seconds:g} must be a positive time [s]')
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(NAME, enable_rosout=False, start_parameter_services=False)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        _discover(node, executor)
        topics = {t: types for t, types in node.get_topic_names_and_types()
                  if node.get_publishers_info_by_topic(t)
                  or node.get_subscriptions_info_by_topic(t)}
        heard = _listen(node, executor, topics, seconds)
        simulated = bool(node.get_publishers_info_by_topic('/clock'))
        return [_nodes(node), *_quality(node, topics), *_clocks(node, executor),
                *(_samples(topic, len(node.get_publishers_info_by_topic(topic)), batch, seconds,
                           simulated)
                  for topic, batch in sorted(heard.items())),
                *([] if heard else [Finding('warn', 'samples', 'no accelerometer is published',
                                            'start a sensor, `ros2 run ssi_ros simulator_node`, '
                                            'or `ssi_ros play BAG`')])]
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()


def _spin(executor, seconds, until=lambda: False):
    end = time.monotonic() + seconds
    while time.monotonic() < end and not until():
        executor.spin_once(timeout_sec=0.05)


def _discover(node, executor):
    """Wait until the graph has not changed for a while."""
    began = changed = time.monotonic()
    known = None
    while time.monotonic() < began + MOST_S:
        _spin(executor, 0.2)
        now = (sorted(_names(node)), node.get_topic_names_and_types())
        if now != known:
            known, changed = now, time.monotonic()
        elif time.monotonic() > max(began + LEAST_S, changed + QUIET_S):
            return


def _names(node):
    full = [f'{space.rstrip("/")}/{name}' for name, space in node.get_node_names_and_namespaces()]
    return [n for n in full if n != f'/{NAME}']


def _nodes(node):
    names = _names(node)
    twice = sorted(n for n, count in Counter(names).items() if count > 1)
    if twice:
        return Finding('error', 'names', 'more than one node is named ' + ', '.join(twice)
                       + ': their topics and services mix',
                       'end one, or start it with --ros-args -r __node:=OTHER')
    return Finding('ok', 'names', f'{things(len(names), "node")}, each name once' if names else
                   'no node runs')


def _quality(node, topics):
    """Compare every publisher with every subscription of its topic."""
    found, pairs = [], 0
    for topic, types in sorted(topics.items()):
        if len(types) > 1:
            found.append(Finding('error', 'types', f'{topic} has {" and ".join(types)}: these '
                                 'never connect', f'remap one: --ros-args -r {topic}:=OTHER'))
        for p in node.get_publishers_info_by_topic(topic):
            for s in node.get_subscriptions_info_by_topic(topic):
                answer, reason = qos_check_compatible(p.qos_profile, s.qos_profile)
                pairs += 1
                if answer == QoSCompatibility.ERROR and s.node_name != NAME:
                    found.append(Finding(
                        'error', 'QoS', f'{topic}: {p.node_name} and {s.node_name} never connect '
                        f'({reason.removeprefix("ERROR: ").rstrip(";")})',
                        f'set reliable to false at {s.node_name}, or publish reliable'))
    return found or [Finding('ok', 'QoS', f'{things(pairs, "pair")} of publisher and '
                             'subscription, none in conflict')]


def _clocks(node, executor):
    """Compare who publishes simulated time with who reads it."""
    sources = [p.node_name for p in node.get_publishers_info_by_topic('/clock')]
    asked = {}
    for name in set(_names(node)):
        client = node.create_client(GetParameters, f'{name}/get_parameters')
        if client.service_is_ready():
            asked[name] = client.call_async(GetParameters.Request(names=['use_sim_time']))
    _spin(executor, ANSWER_S, lambda: all(f.done() for f in asked.values()))
    simulated = {name: f.result().values[0].bool_value for name, f in asked.items()
                 if f.done() and f.result().values}
    on = sorted(n for n, sim in simulated.items() if sim)
    off = sorted(n for n, sim in simulated.items()
                 if not sim and n.rsplit('/', 1)[-1] not in sources)
    if len(sources) > 1:
        return [Finding('error', 'clock', f'{" and ".join(sorted(sources))} publish /clock: time '
                        'jumps', 'end one of them')]
    if on and not sources:
        return [Finding('error', 'clock', f'{", ".join(on)} wait for simulated time, and nobody '
                        'publishes /clock', 'set use_sim_time to false, or start its source')]
    if sources and off:
        return [Finding('warn', 'clock', f'{sources[0]} publishes /clock, but {", ".join(off)} '
                        'use the time of this machine', 'set use_sim_time to true there')]
    return [Finding('ok', 'clock', f'simulated time of {sources[0]}' if sources else
                    'time of the machine')]


def _listen(node, executor, topics, seconds):
    """Collect (stamp, receipt) [ns] of the samples of every sensor topic."""
    heard, subscriptions, readers = {}, [], {}
    for topic, types in topics.items():
        offers = [p.qos_profile for p in node.get_publishers_info_by_topic(topic)]
        if len(types) == 1 and types[0] in SENSORS and offers:
            heard[topic] = deque()
            readers[topic] = field_reader(types[0], SENSORS[types[0]], definition_of(types[0]))
            subscriptions.append(node.create_subscription(
                message_class(types[0]), topic,
                lambda raw, put=heard[topic].append: put((raw, time.time_ns())),
                adapted_qos(offers, 5000), raw=True))
    if subscriptions:
        _spin(executor, seconds)
    out = {}
    for topic, batch in heard.items():
        stamps = [readers[topic].read(raw)[0] for raw, _ in batch]
        out[topic] = np.array(stamps, dtype=np.int64), np.array([ns for _, ns in batch], np.int64)
    for subscription in subscriptions:
        node.destroy_subscription(subscription)
    return out


def _span(seconds):
    """Return a time in the unit in which it is read: 3600 s, 12 days, 25.2 years."""
    for unit, length in (('years', 365.25 * 86400.0), ('days', 86400.0)):
        if seconds > 3.0 * length:
            return f'{seconds / length:.3g} {unit}'
    return f'{seconds:.5g} s'


def _samples(topic, publishers, batch, seconds, simulated=False):
    """Say what a topic brings: rate, missing samples, stamps, those of /clock if simulated."""
    stamps, received = batch
    if publishers > 1:
        return Finding('error', 'samples', f'{topic}: {publishers} publishers, their samples mix',
                       f'end one, or remap it: --ros-args -r {topic}:=OTHER')
    if len(stamps) < 3:
        return Finding('error', 'samples', f'{topic}: {things(len(stamps), "sample")} in '
                       f'{seconds:g} s',
                       'is the sensor active (`ros2 lifecycle get NODE`)?')
    if not stamps.any():
        return Finding('warn', 'samples', f'{topic}: {len(stamps) / seconds:.1f} Hz, no header '
                       'stamps: the uneven times of receipt are used',
                       'let the driver stamp its samples when they are taken')
    steps = np.diff(stamps)
    period = np.median(steps)
    if (steps < 0).any() or not period:
        return Finding('error', 'samples', f'{topic}: its stamps stand still or go back',
                       'one publisher a topic, and stamps of one clock')
    text = f'{topic}: {1e9 / period:.2f} Hz by its stamps'
    missing = round(np.sum(np.maximum(np.rint(steps / period) - 1.0, 0.0)))
    if missing:
        return Finding('warn', 'samples', text + f', {missing} of {len(stamps) + missing} missing',
                       'publish and subscribe reliable, or enlarge the UDP buffer; is the '
                       'machine busy?')
    if simulated:
        return Finding('ok', 'samples', text + ', in simulated time')
    offset_s = np.median(received - stamps) * 1e-9
    if abs(offset_s) > OFFSET_S:
        return Finding('warn', 'samples', text + f', stamped {_span(abs(offset_s))} '
                       + ('ago' if offset_s > 0.0 else 'ahead of now') + ' by this machine',
                       'a replay or a simulation: use_sim_time; else synchronise the clocks '
                       '(chrony)')
    return Finding('ok', 'samples', text + f', {1e3 * offset_s:.1f} ms after they were taken')
