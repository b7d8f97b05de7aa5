"""What the tests of nodes share: stamps, how they listen, an identifier with a short window."""
from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ssi_ros.ros.messages import window_of

START_NS = 1_000_000_000_000_000_000
RATE_HZ = 100.0
LISTEN = QoSProfile(depth=5000, reliability=ReliabilityPolicy.BEST_EFFORT)


def grid(n, start_ns=START_NS):
    """Return n stamps at 100 Hz."""
    return start_ns + np.arange(n, dtype=np.int64) * 10_000_000


def identifier(bench, **more):
    """Start an identifier on /a and /b with a short window."""
    settings = {'channels': ['/a', '/b'], 'window_s': 20.0, 'hop_s': 5.0, 'reliable': True, **more}
    windows = []
    bench.node.create_subscription(
        DiagnosticArray, '/identifier/modes', lambda m: windows.append(window_of(m)), 100)
    health = bench.collect(DiagnosticArray, '/diagnostics')
    bench.processes.start('identifier', 'identifier', **settings)
    return windows, health


def newest(health, name):
    """Return the newest status of a full name, None before it came."""
    return next((s for m in reversed(health) for s in m.status if s.name == name), None)
