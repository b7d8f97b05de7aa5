"""The monitor hears the gap node's topics: meter, site, leading effect and alarm, in words."""
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray
from ssi_ros.gap.online.sliding import GapUpdate
from ssi_ros.records import Mode, WindowModes
from ssi_ros.ros.gap_messages import where_message
from ssi_ros.ros.messages import modes_message
from std_msgs.msg import Float64


def test_monitor_hears_the_gap_node(bench):
    """What `where_message` writes, and the three numbers, are on the monitor's screen."""
    update = GapUpdate(0, 600_000_000_000, 0.25, 0.11, 0.002, {}, {
        'structure': 0.9, 'sensor': 0.1}, 'array_asymmetry', 'array_asymmetry', 12.5, 1e-9,
        raised_ns=600_000_000_000, cause='the meter')
    window = WindowModes(0, 600_000_000_000, (Mode(1.5, 0.005, [1.0, -1.0], identity=4),))
    sent = [(Float64, 'gap', Float64(data=update.value)),
            (Float64, 'floor', Float64(data=update.floor)),
            (Float64, 'deviations', Float64(data=update.deviations)),
            (DiagnosticArray, 'where', where_message(update))]
    ends = [(bench.node.create_publisher(kind, f'/gap/{name}', 10), message)
            for kind, name, message in sent]
    modes = bench.node.create_publisher(DiagnosticArray, '/identifier/modes', 10)
    monitor = subprocess.Popen(
        [sys.executable, '-m', 'ssi_ros', 'monitor', '--plain', '--windows', '1'],
        env=bench.processes.environment, stdout=subprocess.PIPE, text=True)
    try:
        bench.wait(lambda: all(p.get_subscription_count() for p, _ in ends)
                   and modes.get_subscription_count())

        def send():
            """Send the numbers of the gap."""
            for publisher, message in ends:
                publisher.publish(message)
            bench.executor.spin_once(timeout_sec=0.3)

        def heard():
            """Send again until it has ended."""
            send()
            modes.publish(modes_message(window))
            return monitor.poll() is not None
        for _ in range(10):         # a reader learns of a writer later than the writer of it
            send()
        bench.wait(heard)
        out = monitor.communicate(timeout=10)[0]
    finally:
        monitor.kill()
    assert monitor.returncode == 0
    assert 'gap 0.2500 nats, floor 0.1100, +70.0 sd' in out
    assert 'structure 90 %' in out and 'array_asymmetry: +12.5 sd' in out
    assert 'ERROR alarm: raised' in out and '1.5000' in out
