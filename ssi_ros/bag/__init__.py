"""MCAP bags in the layout of rosbag2, read and written without ROS."""
from .cdr import field_reader
from .definitions import definition_of, type_hash_of

__all__ = ['definition_of', 'field_reader', 'type_hash_of']
