"""Real nodes in processes of their own, over real DDS on the loopback."""
import time

import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS 2 is not installed')

from rclpy.experimental import EventsExecutor            # noqa: E402
from rclpy.signals import SignalHandlerOptions           # noqa: E402

from ssi_ros.ros.demo import Processes                   # noqa: E402

PATIENCE_S = 30.0


class Bench:
    """A node of the test itself: publish, subscribe, call, wait."""

    def __init__(self, folder):
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node('bench')
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)
        self.processes = Processes(folder)

    def collect(self, message_class, topic, qos=100):
        """Return a list that fills with the messages of a topic."""
        messages = []
        self.node.create_subscription(message_class, topic, messages.append, qos)
        return messages

    def wait(self, condition, patience_s=PATIENCE_S, what=''):
        """Spin until the condition holds."""
        end = time.monotonic() + patience_s
        while not condition():
            assert time.monotonic() < end, f'waited {patience_s} s in vain {what}'
            self.executor.spin_once(timeout_sec=0.05)

    def call(self, service_class, name, request):
        """Call a service and return its response."""
        client = self.node.create_client(service_class, name)
        self.wait(client.service_is_ready, what=f'for {name}')
        future = client.call_async(request)
        self.wait(future.done, what=f'for the answer of {name}')
        return future.result()

    def words(self, name):
        """Return what a node has printed."""
        return (self.processes.log_folder / f'{name}.txt').read_text()

    def ended(self, name, patience_s=PATIENCE_S):
        """Wait for the end of a node; return its exit code."""
        return self.processes.running.pop(name).wait(timeout=patience_s)

    def close(self):
        """End everything."""
        self.processes.kill()
        self.node.destroy_node()
        rclpy.try_shutdown()


@pytest.fixture
def bench(own_domain, tmp_path):
    """Return a bench whose logs go to the test's folder."""
    bench = Bench(tmp_path / 'log')
    yield bench
    bench.close()
