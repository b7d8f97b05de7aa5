"""Recorded inputs of a model as topics: kept as they come, in rows when a diagnosis asks."""
from collections import deque
from dataclasses import replace
import time

import numpy as np
from ssi_ros.cli._inputs import input_of
from ssi_ros.inputs.rows import in_rows
from ssi_ros.records import Samples
from ssi_ros.ros.channels import channel_of, Source
from ssi_ros.ros.intake import sample_qos

READ_S = 0.5            # how often the raw bytes are read
MARGIN = 1.5            # lengths of a record that are kept: its last rows wait for their samples
# the message that a field is of, by its first member: a topic may not be there yet to be asked
TYPES = {'wrench': 'geometry_msgs/msg/WrenchStamped', 'vector': 'geometry_msgs/msg/Vector3Stamped',
         'force': 'geometry_msgs/msg/Wrench', 'torque': 'geometry_msgs/msg/Wrench',
         'effort': 'sensor_msgs/msg/JointState', 'data': 'std_msgs/msg/Float64'}


class InputTopics:
    """
    Subscribe to the inputs that a task names.

    Parameters
    ----------
    node : StageNode
        Whose subscriptions these are.
    settings : SampleInput
        How topics are read.
    task : GapTask
        With the entries, and how long a record is.
    model : Spacecraft or LinearModel
        Whose inputs they are.

    Raises
    ------
    ValueError
        For an entry that cannot be read, or an input that the model has not.

    """

    def __init__(self, node, settings, task, model):
        self.node, self.kept_s = node, MARGIN * task.record_s
        self.sources = [Source(channel_of_input(t, model), settings.stamp_source)
                        for t in task.inputs if t]
        names = [s.name for s in self.sources]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f'two entries of inputs are of the input {name} of the model; '
                                 'write /topic:field=NAME for each')
        self._raw = [deque() for _ in self.sources]
        self._read = [(np.zeros(0, np.int64), np.zeros(0)) for _ in self.sources]
        self._subscriptions = [
            node.create_subscription(s.message_class, s.topic, self._collector(raw),
                                     sample_qos(settings), raw=True)
            for s, raw in zip(self.sources, self._raw)]
        self._timer = node.every(READ_S, self._drain) if self.sources else None

    def release(self):
        """Give the subscriptions back."""
        if self._timer is not None:
            self.node.destroy_timer(self._timer)
        for subscription in self._subscriptions:
            self.node.destroy_subscription(subscription)

    def beside(self, record):
        """Return the inputs in the rows of a record, None without any, and why they are not."""
        if not self.sources:
            return None, ''
        self._drain()
        columns = []
        for source, (stamps, values) in zip(self.sources, self._read):
            try:
                columns.append(in_rows(stamps, values, record))
            except ValueError as error:
                return None, f'the input {source.topic}:{source.field} {error}'
        return Samples(np.column_stack(columns), record.rate_hz,
                       tuple(s.name for s in self.sources), record.start_ns), ''

    def _collector(self, raw):
        if self.node.get_parameter('use_sim_time').value:
            clock = self.node.get_clock()
            return lambda message: raw.append((message, clock.now().nanoseconds))
        return lambda message: raw.append((message, time.time_ns()))

    def _drain(self):
        for i, (source, raw) in enumerate(zip(self.sources, self._raw)):
            if not raw:
                continue
            batch = [raw.popleft() for _ in range(len(raw))]
            stamps, values = source.read(batch, self._note)
            stamps, values = (np.concatenate(pair)
                              for pair in zip(self._read[i], (stamps, values)))
            if len(stamps):
                # a jump of the clock back begins anew
                recent = (stamps > stamps[-1] - self.kept_s * 1e9) & (stamps <= stamps[-1] + 1e9)
                stamps, values = stamps[recent], values[recent]
            self._read[i] = stamps, values

    def _note(self, text):
        self.node.get_logger().warning(text, throttle_duration_sec=5.0)


def channel_of_input(text, model):
    """
    Return the Channel of an entry of the parameter `inputs`, named after an input of the model.

    Raises
    ------
    ValueError
        If it cannot be read, the type cannot be known, or the model has no such input.

    """
    if text.lstrip().startswith('{'):
        found = channel_of(text)
        name = found.name if 'name:' in text else None
        return replace(found, name=input_of(model, name, found.topic, found.field))
    words, _, name = text.partition('=')
    topic, _, field = words.partition(':')
    field = field or 'data'
    member = field.partition('.')[0].partition('[')[0]
    if member not in TYPES or not topic.strip('/'):
        raise ValueError(f'inputs: {text!r} must be /topic:field with a field of '
                         f'{", ".join(TYPES)}, or {{topic: T, type: pkg/msg/Type, field: F, '
                         'name: NAME}')
    kind = 'std_msgs/msg/Float64MultiArray' if field.startswith('data[') else TYPES[member]
    found = channel_of(f'{{topic: {topic}, type: {kind}, field: "{field}"}}')
    return replace(found, name=input_of(model, name or None, topic, field))
