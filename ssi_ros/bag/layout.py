"""The words of rosbag2 (ROS 2 Jazzy): quality of service and metadata.yaml, version 9."""
from dataclasses import dataclass
import os

import yaml

ROOT = 'rosbag2_bagfile_information'
_FOREVER = {'sec': 9223372036, 'nsec': 854775807}
_WORDS = {'history': ('system_default', 'keep_last', 'keep_all', 'unknown'),
          'reliability': ('system_default', 'reliable', 'best_effort', 'unknown',
                          'best_available'),
          'durability': ('system_default', 'transient_local', 'volatile', 'unknown',
                         'best_available'),
          'liveliness': ('system_default', 'automatic', 'manual_by_node', 'manual_by_topic',
                         'unknown', 'best_available')}


@dataclass(frozen=True)
class Qos:
    """The quality of service that a publisher offers, in rosbag2's words."""

    reliability: str = 'reliable'
    durability: str = 'volatile'
    history: str = 'keep_last'
    depth: int = 10
    liveliness: str = 'automatic'

    def __post_init__(self):
        for name, words in _WORDS.items():
            if getattr(self, name) not in words:
                raise ValueError(f'{name}={getattr(self, name)!r} must be one of '
                                 + ', '.join(words))
        if isinstance(self.depth, bool) or not isinstance(self.depth, int) or self.depth < 0:
            raise ValueError(f'depth={self.depth!r} must be a whole number, 0 or more')

    def plain(self):
        """Return the profile as rosbag2 Jazzy lists it; deadline and lifespan are infinite."""
        return {'history': self.history, 'depth': self.depth, 'reliability': self.reliability,
                'durability': self.durability, 'deadline': dict(_FOREVER),
                'lifespan': dict(_FOREVER), 'liveliness': self.liveliness,
                'liveliness_lease_duration': dict(_FOREVER),
                'avoid_ros_namespace_conventions': False}


SENSOR = Qos(reliability='best_effort', depth=5)      # rmw_qos_profile_sensor_data


def profiles_of(qos):
    """
    Return plain profiles of a Qos, of a mapping of its words, or of several of either.

    Raises
    ------
    ValueError
        For a word that rosbag2 does not have.

    """
    if qos is None:
        return []
    profiles = []
    for one in qos if isinstance(qos, (list, tuple)) else (qos,):
        if isinstance(one, dict) and 'deadline' in one:        # already in the plain form
            profiles.append(one)
        elif isinstance(one, dict):
            unknown = set(one) - set(Qos.__dataclass_fields__)
            if unknown:
                raise ValueError(f'qos has no {", ".join(sorted(unknown))}; it has '
                                 + ', '.join(Qos.__dataclass_fields__))
            profiles.append(Qos(**one).plain())
        elif isinstance(one, Qos):
            profiles.append(one.plain())
        else:
            raise ValueError(f'qos={one!r} must be a Qos or a mapping of its words')
    return profiles


@dataclass(frozen=True)
class Topic:
    """
    A topic of a bag.

    Attributes
    ----------
    name, type : str
        Topic and `pkg/msg/Type`.
    qos : tuple of dict
        Offered quality of service in the plain form of rosbag2.
    definition, type_hash : str
        Definition text and RIHS01 hash; empty where a bag does not tell.
    encoding : str
        How the messages are serialised; 'cdr' in ROS 2.
    count : int
        Number of messages.

    """

    name: str
    type: str  # noqa: A003, the word of ROS
    qos: tuple = ()
    definition: str = ''
    type_hash: str = ''
    encoding: str = 'cdr'
    count: int = 0


def channel_metadata(topic):
    """Return the metadata of the topic's MCAP channel: words to words."""
    profiles = list(topic.qos)
    text = yaml.safe_dump(profiles, sort_keys=False).strip() if profiles else ''
    return {'offered_qos_profiles': text, 'topic_type_hash': topic.type_hash}


def information(topics, files, custom_data=None):
    """
    Return what metadata.yaml holds below its root.

    Parameters
    ----------
    topics : sequence of Topic
        With their counts.
    files : sequence of (name, start_ns, end_ns, count)
        The splits in order; times are None for a file without messages.
    custom_data : dict, optional
        Words to words.

    Returns
    -------
    dict

    """
    starts = [f[1] for f in files if f[1] is not None]
    start = min(starts, default=0)
    end = max((f[2] for f in files if f[2] is not None), default=0)

    def span(first, last):
        return {'starting_time': {'nanoseconds_since_epoch': first or 0},
                'duration': {'nanoseconds': (last or 0) - (first or 0)}}

    whole = span(start, end)
    return {
        'version': 9, 'storage_identifier': 'mcap', 'duration': whole['duration'],
        'starting_time': whole['starting_time'], 'message_count': sum(f[3] for f in files),
        'topics_with_message_count': [
            {'topic_metadata': {
                'name': t.name, 'type': t.type, 'serialization_format': t.encoding,
                'offered_qos_profiles': list(t.qos), 'type_description_hash': t.type_hash},
             'message_count': t.count} for t in topics],
        'compression_format': '', 'compression_mode': '',
        'relative_file_paths': [f[0] for f in files],
        'files': [{'path': f[0], **span(f[1], f[2]), 'message_count': f[3]} for f in files],
        'custom_data': dict(custom_data) if custom_data else None, 'ros_distro': 'jazzy'}


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data):      # yaml-cpp of rosbag2 writes none
        return True


def dump(mapping):
    """Return YAML text with the keys in their order."""
    return yaml.dump(mapping, Dumper=_Dumper, sort_keys=False, default_flow_style=False)


def save_information(folder, info):
    """Write metadata.yaml so that it is there whole or not at all."""
    final = folder / 'metadata.yaml'
    draft = folder / '.metadata.yaml.tmp'
    try:
        with open(draft, 'w') as f:
            f.write(dump({ROOT: info}))
            f.flush()
            os.fsync(f.fileno())
        draft.replace(final)
    except OSError:
        draft.unlink(missing_ok=True)
        raise
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
