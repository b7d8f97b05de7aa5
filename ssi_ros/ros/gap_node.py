"""
Gap node: accelerometers in, how far they are from the model out, with an alarm and a diagnosis.

A timer reads the samples into rows; a worker thread runs the meter of `ssi_ros.gap.online.sliding`
on sliding windows; `~/diagnose` runs the full analysis of the last samples in a process of its
own, so that no sample waits for it. On a replayed bag the results are those of the live run.
"""
import json
import queue
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from ssi_ros.effects import effect_class, load_configuration
from ssi_ros.gap.online.calibration import LiveSettings, prepare
from ssi_ros.gap.online.sliding import order_of
from ssi_ros.gap.online.stream import LiveStream
from ssi_ros.gap.settings import load_settings
from ssi_ros.ros import health
from ssi_ros.ros.gap_messages import sites_message, where_message
from ssi_ros.ros.gap_task import GapTask, missing_words, refusal
from ssi_ros.ros.identifier_settings import SampleInput
from ssi_ros.ros.intake import Intake
from ssi_ros.ros.intake_words import waits_for, watches
from ssi_ros.ros.last_rows import LastRows
from ssi_ros.ros.messages import clock_words
from ssi_ros.ros.node import run, StageNode
from ssi_ros.ros.recorded_inputs import InputTopics
from ssi_ros.ros.worker import Background, diagnose_to_json
from std_msgs.msg import Bool, Float64, Float64MultiArray, String
from std_srvs.srv import Trigger

LOOK_S = 0.2              # how often a running diagnosis is looked at
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class GapNode(StageNode):
    """Measure the gap of the accelerometers to a model."""

    settings_classes = (SampleInput, GapTask, LiveSettings)

    def __init__(self, **kwargs):
        super().__init__('gap', **kwargs)
        self._publishers_made, self._services_made = [], []   # rclpy has `_services`
        self._intake = self._worker = self._look = self._last = self._inputs = None
        self._preparation, self._background = Background(), Background(niceness=5)
        self._waiting = []

    def configure(self, source, task, settings):
        """Read the model, subscribe, advertise, and start the worker."""
        self._spacecraft, self._present = load_configuration(task.model or None)
        self._diagnosis = load_settings(task.diagnosis or None)
        self._effects = tuple(effect_class(e).name for e in task.effects if e) or None
        self._intake = Intake(self, source, self._spacecraft.rate_hz, self._take, together=True)
        self._inputs = InputTopics(self, source, task, self._spacecraft)
        names = [n.rsplit('/', 1)[-1] for n in self._intake.names]
        order_of(self._spacecraft, names)
        self._numbers = {n: self._advertise(Float64, f'~/{n}', 100)
                         for n in ('gap', 'floor', 'deviations', 'leading_z', 'alarm_level')}
        self._sites = self._advertise(Float64MultiArray, '~/sites', 100)
        self._where = self._advertise(DiagnosticArray, '~/where', 100)
        self._alarm = self._advertise(Bool, '~/alarm', LATCHED)
        self._answer = self._advertise(String, '~/diagnosis', LATCHED)
        diagnose = self.create_service(Trigger, '~/diagnose', lambda request, response: response)
        # the answer is sent when the diagnosis is there; until then nothing waits in a callback
        self._reply = diagnose.send_response
        diagnose.send_response = self._diagnose
        reset = self.create_service(Trigger, '~/reset_alarm', self._reset)
        self._services_made = [diagnose, reset]
        self._names, self._task = names, task
        # in this process it would hold up the samples: Python runs one thread at a time
        self._preparation.start(prepare, self._spacecraft, settings, present=self._present,
                                effects=self._effects)
        self._worker = Worker(self, names, settings)
        self._look = self.every(LOOK_S, self._look_after)

    def announcement(self):
        """Say what it waits for."""
        return waits_for(self._intake)

    def watching(self, rows):
        """Return the line that says what is watched, when the first row of it is there."""
        settings = self.settings[2]
        return (watches(self._intake, rows, settings.window_s)
                + f', the first part of it after {settings.hop_s:g} s')

    def _advertise(self, message_class, topic, qos):
        publisher = self.create_lifecycle_publisher(message_class, topic, qos)
        self._publishers_made.append(publisher)
        return publisher

    def activate(self):
        """Let the samples in."""
        self._intake.begin()
        self._last = LastRows(self._names, self._spacecraft.rate_hz, self._task.record_s)
        self._worker.begin()
        self._alarm.publish(Bool(data=False))
        self._intake.open()

    def deactivate(self):
        """Keep the samples out; the window begins anew after the next activation."""
        if self._intake is not None:
            self._intake.close()

    def cleanup(self):
        """Release all that `configure` created."""
        self._preparation.stop()
        self._background.stop()
        self._finish('failed', 'the node was stopped')
        if self._look is not None:
            self.destroy_timer(self._look)
        if self._intake is not None:
            self._intake.release()
        if self._inputs is not None:
            self._inputs.release()
        if self._worker is not None:
            self._worker.stop()
        for publisher in self._publishers_made:
            self.destroy_lifecycle_publisher(publisher)
        for service in self._services_made:
            self.destroy_service(service)
        self._publishers_made, self._services_made = [], []
        self._intake = self._worker = self._look = self._inputs = None

    def settings_changed(self, source, task, settings):
        """Take another alarm rate or share of missing rows."""
        self._worker.change(settings)

    def _take(self, rows):
        self._last.push(rows)
        self._worker.rows.put(rows)

    def publish(self, update):
        """Publish one window; called by the worker."""
        if not self._intake.is_open:
            return
        for name, publisher in self._numbers.items():
            value = getattr(update, {'gap': 'value'}.get(name, name))
            publisher.publish(Float64(data=float(value)))
        self._sites.publish(sites_message(update))
        self._where.publish(where_message(update))
        if update.raised_ns == update.end_ns:
            self._alarm.publish(Bool(data=True))
            self.get_logger().warning(f'alarm: the samples have left the model ({update.cause}), '
                                      f'window ending at {clock_words(update.end_ns)}; call '
                                      '~/diagnose for the cause, ~/reset_alarm to watch anew')

    def _reset(self, request, response):
        response.success = self._worker.acknowledge()
        response.message = ('the alarm is quiet and watches anew' if response.success else
                            'no alarm was raised')
        if response.success:
            self._alarm.publish(Bool(data=False))
        return response

    def _diagnose(self, response, header):
        """Begin the diagnosis that a caller waits for."""
        record = None if self._last is None else self._last.samples()
        inputs = unread = None
        if record is not None:
            inputs, unread = self._inputs.beside(record)
        if self._background.busy:
            why = (f'a diagnosis runs, {100 * self._background.share:.0f} % done; its answer will '
                   'be on ~/diagnosis')
        elif record is None:
            why = 'no samples yet: is the simulator or the player running?'
        elif why := self._intake.mixing.words() or self._intake.apart_words() or refusal(
                record, self.settings[1].diagnosis_missing_share):
            self.get_logger().warning(why)
        elif unread:
            why = f'no diagnosis: {unread}'
            self.get_logger().warning(why)
        else:
            self._waiting.append((response, header))
            self._background.start(diagnose_to_json, self._spacecraft, record, self._diagnosis,
                                   present=self._present, effects=self._effects,
                                   pairs=self._task.pairs, inputs=inputs)
            self.get_logger().info(f'diagnosing the last {record.duration_s:.0f} s; '
                                   + missing_words(record))
            return
        response.success, response.message = False, why
        self._reply(response, header)

    def _look_after(self):
        """See whether the preparation or a diagnosis has ended."""
        if self._preparation.busy:
            answer = self._preparation.poll()
            if answer is not None and answer[0] == 'failed':
                self.get_logger().error(f'the meter cannot be prepared: {answer[1]}')
                self._worker.fault = f'the meter cannot be prepared: {answer[1]}'
            elif answer is not None:
                self._worker.start(answer[1])
        if self._background.busy:
            answer = self._background.poll()
            if answer is not None:
                self._finish(*answer)

    def _finish(self, kind, found):
        """Send the answer of a diagnosis to the topic and to whoever asked."""
        text = json.dumps(found) if kind == 'done' else found
        if kind == 'done':
            self._answer.publish(String(data=text))
            self.get_logger().info(f'{found["outcome"]}: {found["reason"]}')
        waiting, self._waiting = self._waiting, []
        for response, header in waiting:
            response.success, response.message = kind == 'done', text
            self._reply(response, header)

    def health(self):
        """Tell of every channel, of the meter and of the alarm."""
        states = self._intake.states()
        return [health.channel(self.get_name(), s) for s in states] + health.meter(
            self.get_name(), states, self._worker, self._preparation, self._background)


class Worker:
    """The thread that measures, and what it works on."""

    def __init__(self, node, names, settings):
        self.node, self.names, self.settings = node, names, settings
        self.lock = threading.Lock()
        self.rows = queue.SimpleQueue()
        self.fault, self.model, self.stream = '', None, None
        self.updates, self.compute_s, self.last = 0, 0.0, None
        self.thread = None

    def start(self, model):
        """Take the model and begin to work on the rows that wait."""
        self.model = model
        self.thread = threading.Thread(target=self._work, daemon=True)
        self.thread.start()

    def begin(self):
        """Begin anew with the next sample, the alarm too."""
        with self.lock:
            self.stream = None

    def change(self, settings):
        """Take settings that do not shape the window."""
        with self.lock:
            self.settings = settings
            if self.stream is not None:
                self.stream.change(settings)

    def acknowledge(self):
        """Take the alarm back; return whether there was one."""
        with self.lock:
            raised = self.stream is not None and self.stream.meter.alarm.raised_ns is not None
            if raised:
                self.stream.meter.acknowledge()
                self.last = None
        return raised

    def stop(self):
        """End the thread."""
        if self.thread is not None:
            self.rows.put(None)
            self.thread.join(timeout=10.0)

    def _work(self):
        while (rows := self.rows.get()) is not None:
            self._take(rows)

    def _take(self, rows):
        before = time.thread_time()
        updates = []
        try:
            with self.lock:
                if self.stream is None:
                    self.stream = LiveStream(self.model, self.names, self.settings)
                updates = self.stream.push(rows)
        except Exception as error:      # a node never dies of data: say it, go on
            self.node.get_logger().error(f'a hop could not be measured ({type(error).__name__}: '
                                         f'{error}); the window begins anew')
            self.begin()
        for update in updates:
            self.updates += 1
            self.compute_s = (time.thread_time() - before) / len(updates)
            self.last = update
            self.node.publish(update)


def main(args=None):
    """Run the node until SIGINT or SIGTERM."""
    return run(GapNode, args)


if __name__ == '__main__':
    raise SystemExit(main())
