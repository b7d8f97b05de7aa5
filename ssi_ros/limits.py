"""
What a file may ask of the machine that reads it: every bound in one place, with its reason.

A file that somebody was sent must not hang, fill the memory or run code. Sizes that a file claims
are checked against these bounds before a byte is taken for them.
"""
from dataclasses import dataclass

from ssi_ros.quantity import check, quantity

MIB = 1 << 20
LATEST_NS = 2 ** 63 - 1           # ROS keeps times in signed 64-bit integers


@dataclass(frozen=True)
class Limits:
    """Bounds on what is read; `doc` holds the reason of each."""

    chunk_bytes: int = quantity(
        64 * MIB, unit='byte', low=MIB, high=1 << 34,
        doc='a chunk, decompressed: rosbag2 writes 0.75 MiB, and two copies of it stay below the '
        '300 MB that `info` may take')
    ratio: float = quantity(
        200.0, low=1.0, high=1e6,
        doc='decompressed bytes a byte of the file: telemetry packs 3 to 30 times, a bomb 10,000')
    spared_bytes: int = quantity(
        256 * MIB, unit='byte', low=MIB, high=1 << 40,
        doc='decompressed bytes that any file may hold whatever its ratio: they are read in 5 s')
    chunks: int = quantity(
        300_000, low=1, high=1 << 31,
        doc='chunks of one file: 300 GB in chunks of 1 MiB; 100 bytes each are kept of them')
    run_bytes: int = quantity(
        16 * MIB, unit='byte', low=1024, high=1 << 30,
        doc='messages outside of chunks that are read at once')
    record_bytes: int = quantity(
        16 * MIB, unit='byte', low=1024, high=1 << 30,
        doc='one schema, channel, metadata or index record: real ones stay below 1 MiB')
    waiting_bytes: int = quantity(
        256 * MIB, unit='byte', low=MIB, high=1 << 40,
        doc='messages that wait for older ones of later chunks while a bag is played')
    yaml_bytes: int = quantity(
        4 * MIB, unit='byte', low=1024, high=1 << 30,
        doc='metadata.yaml: 20,000 splits or 4,000 topics, read in 2 s')
    yaml_depth: int = quantity(
        32, low=4, high=200, doc='nesting of YAML: metadata.yaml of rosbag2 has 7 levels')
    yaml_nodes: int = quantity(
        1_000_000, low=100, high=1 << 31,
        doc='values of YAML once its aliases are written out')
    schema_bytes: int = quantity(
        MIB, unit='byte', low=1024, high=1 << 30,
        doc='definition text of one type: the longest of ROS 2 Jazzy has 30 kB')
    schema_types: int = quantity(
        1000, low=10, high=1 << 20, doc='types that one definition may hold')
    schema_depth: int = quantity(
        32, low=4, high=200, doc='types within types: the deepest of ROS 2 Jazzy have 8')
    schema_steps: int = quantity(
        100_000, low=100, high=1 << 30,
        doc='members that are passed on the way to a field of one message: 0.1 s')
    topics: int = quantity(
        10_000, low=10, high=1 << 20, doc='topics of one bag: a large robot has 1,000')
    topic_samples: int = quantity(
        1_000_000, low=1000, high=1 << 31,
        doc='times of messages that `info` keeps before it folds them into its statistics')
    sqlite_ops: int = quantity(
        200, unit='1e6 operations', low=1, high=1 << 20,
        doc='virtual machine steps of one SQLite query: a view may be infinite')
    grid_numbers: int = quantity(
        100_000_000, low=1000, high=1 << 40,
        doc='rows times channels of an even grid that are made at once: 0.8 GB, 70 h of 4 '
        'channels at 100 Hz')
    gap_numbers: int = quantity(
        4_000_000, low=1000, high=1 << 40,
        doc='rows times channels of one gap; a longer one begins a new segment: 1000 s of 4 '
        'channels at 1 kHz')
    sparse: int = quantity(
        300, low=2, high=1 << 20,
        doc='rows that one sample may stand for before the rate is not believed')
    table_columns: int = quantity(
        1000, low=1, high=1 << 20, doc='channels of one table: each becomes a topic')

    def __post_init__(self):
        check(self)

    def total_bytes(self, size):
        """Return how many bytes the chunks of a file of that size may hold, decompressed."""
        return max(self.spared_bytes, int(self.ratio * size))


LIMITS = Limits()
