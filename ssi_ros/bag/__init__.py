"""MCAP bags in the layout of rosbag2, read and written without ROS."""
from .cdr import field_reader
from .channels import Channel, find_channels, parse_channel, read_channels, Recording
from .definitions import definition_of, type_hash_of
from .layout import Qos
from .play import schedule, stamp_shifter
from .read import Bag, open_bag
from .recover import recover, RecoverReport
from .samples import encode_accel, write_samples
from .writer import BagWriter

__all__ = ['Bag', 'BagWriter', 'Channel', 'definition_of', 'encode_accel', 'field_reader',
           'find_channels', 'open_bag', 'parse_channel', 'Qos', 'read_channels', 'recover',
           'Recording', 'RecoverReport', 'schedule', 'stamp_shifter', 'type_hash_of',
           'write_samples']
