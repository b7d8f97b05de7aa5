"""Real nodes in processes of their own, over real DDS on the loopback."""
import time

import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS 2 is not installed')

from rclpy.experimental import EventsExecutor            # noqa: E402
from rclpy.signals import SignalHandlerOptions           # noqa: E402

from ssi_ros.ros.demo import Processes                   # noqa: E402

PATIENCE_S = 30.0
AGAIN_S = 10.0          # after which a call of a service is repeated
LINES = 8               # of a node, printed where a wait was in vain


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
            assert time.monotonic() < end, (
                f'waited {patience_s} s in vain {what}\n{self.last_words()}')
            self.executor.spin_once(timeout_sec=0.05)

    def call(self, service_class, name, request):
        """Call a service and return its response; what has no answer is asked again."""
        client = self.node.create_client(service_class, name)
        self.wait(client.service_is_ready, what=f'for {name}')
        futures, end = [], time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            # a server that has not found its client yet cannot answer it, and says so in its log
            futures.append(client.call_async(request))
            again = time.monotonic() + AGAIN_S
            while time.monotonic() < again:
                self.executor.spin_once(timeout_sec=0.05)
                for future in futures:
                    if future.done():
                        return future.result()
        raise AssertionError(f'waited {PATIENCE_S} s in vain for the answer of {name}\n'
                             f'{self.last_words()}')

    def words(self, name):
        """Return what a node has printed."""
        return (self.processes.log_folder / f'{name}.txt').read_text()

    def last_words(self):
        """Return the last lines of all nodes."""
        logs = sorted(self.processes.log_folder.glob('*.txt'))
        return '\n'.join([f'{log.stem}: {line}' for log in logs
                          for line in log.read_text().splitlines()[-LINES:]])

    def ended(self, name, patience_s=PATIENCE_S):
        """Wait for the end of a node; return its exit code."""
        return self.processes.running.pop(name).wait(timeout=patience_s)

    def close(self):
        """End everything."""
        self.processes.kill()
        # a subscription that is destroyed while the executor still listens to it may end in a
        # segmentation fault (ros2/rclpy #1644): first it lets go of the node, then it ends
        self.executor.remove_node(self.node)
        self.executor.spin_once(timeout_sec=0.0)
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()


@pytest.fixture
def bench(own_domain, tmp_path):
    """Return a bench whose logs go to the test's folder."""
    bench = Bench(tmp_path / 'log')
    yield bench
    bench.close()
