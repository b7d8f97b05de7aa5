"""What nodes that read samples can be told about where they come from."""
from dataclasses import dataclass

from ssi_ros.quantity import quantity


@dataclass(frozen=True)
class SampleInput:
    """Where the samples come from and how they are put on a grid."""

    channels: tuple = quantity(
        ('{topic: accelerometer/e1_a}', '{topic: accelerometer/e1_b}',
         '{topic: accelerometer/e2_a}', '{topic: accelerometer/e2_b}'),
        doc='the channels, 1 to 64 entries {topic: T, type: pkg/msg/Type, field: a.b[0], '
            'name: N}; type and field default to geometry_msgs/msg/AccelStamped and '
            'accel.linear.z',
        live=False)
    lateness_s: float = quantity(
        1.0, unit='s', low=0.01, high=60.0, live=False,
        doc='how long a row waits for its last sample, in the time of the stamps; with reliable, '
            'make it longer than any pause of the process')
    stamp_source: str = quantity(
        'auto', live=False,
        doc="'header', 'receive', or 'auto': the header's stamp where there is one and it is not "
            'zero')
    queue_s: float = quantity(
        5.0, unit='s', low=0.1, high=600.0, live=False,
        doc='how much data the subscription holds while the process is busy; of a process that '
            'is stopped the socket holds 200 kB at most, the rest is lost unless reliable')
    expected_rate_hz: float = quantity(
        1000.0, unit='Hz', low=1.0, high=1e5, live=False,
        doc='highest message rate of a topic to be ready for (sizes the subscription queue)')
    reliable: bool = quantity(
        False, live=False, doc='subscribe reliable and keep all, so that the player waits for '
        'this node (a best-effort publisher never connects)')

    def __post_init__(self):
        if self.stamp_source not in ('auto', 'header', 'receive'):
            raise ValueError(f"stamp_source={self.stamp_source!r} must be 'auto', 'header' or "
                             "'receive'")
        if not 1 <= len(self.channels) <= 64:
            raise ValueError(f'channels has {len(self.channels)} entries; 1 to 64 are allowed')


@dataclass(frozen=True)
class IdentifierInput(SampleInput):
    """Input of the identifier: any rate, and slots for its series."""

    rate_hz: float = quantity(
        0.0, unit='Hz', low=0.0, high=1e6, live=False,
        doc='sampling rate, 0 = estimate it from the first 256 stamps')
    slots: int = quantity(
        40, low=1, high=1000, live=False, doc='number of slots in the series topics')
