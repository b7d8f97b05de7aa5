"""The grammar of names in ROS 2: topics and message types."""
import re

# rosidl: packages and types; REP 144. Design article "Topic and Service name mapping to DDS".
_PACKAGE = re.compile(r'(?!.*__)[a-z][a-z0-9_]*(?<!_)')
_TYPE = re.compile(r'[A-Z][A-Za-z0-9]*')
_TOPIC = re.compile(r'(/(?!\w*__)[A-Za-z_][A-Za-z0-9_]*)+', re.ASCII)
_LONGEST = 255            # of DDS


def split_type(type_name):
    """
    Return package and name of `pkg/msg/Type`, by the grammar of ROS 2.

    Raises
    ------
    ValueError
        If it is not of that grammar.

    """
    parts = str(type_name).split('/')
    if (len(parts) != 3 or parts[1] != 'msg' or not _PACKAGE.fullmatch(parts[0])
            or not _TYPE.fullmatch(parts[2])):
        raise ValueError(f'{type_name!r} is not the name of a message type; write it as '
                         'package/msg/Type, such as geometry_msgs/msg/AccelStamped')
    return parts[0], parts[2]


def check_topic(name):
    """
    Return a full topic name.

    Raises
    ------
    ValueError
        If it is not text of the grammar of ROS 2.

    """
    if not isinstance(name, str) or len(name) > _LONGEST or not _TOPIC.fullmatch(name):
        raise ValueError(f'{name!r:.80} is not a topic name: /words of letters, digits and single '
                         f'_, none beginning with a digit, {_LONGEST} characters at most')
    return name
