"""MCAP bags in the layout of rosbag2, read and written without ROS."""
from .cdr import field_reader
from .definitions import definition_of, type_hash_of
from .layout import Qos
from .samples import write_samples
from .writer import BagWriter

__all__ = ['BagWriter', 'definition_of', 'field_reader', 'Qos', 'type_hash_of', 'write_samples']
