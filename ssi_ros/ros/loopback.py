"""Nodes that talk over UDP on the loopback, without shared memory: decision 0005."""
from ssi_ros.model.spacecraft import packaged

PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE'


def shares_memory(environment):
    """Return whether Fast DDS uses shared memory with such variables."""
    if environment.get('ROS_AUTOMATIC_DISCOVERY_RANGE') == 'LOCALHOST':
        return True             # rmw_fastrtps_cpp 8.4.3 then ignores the other variables
    return (not environment.get('FASTDDS_BUILTIN_TRANSPORTS')
            and not any(environment.get(p) for p in PROFILES))


def udp_alone(environment):
    """
    Return the variables that keep nodes off shared memory, and on this machine.

    Parameters
    ----------
    environment : mapping of str
        Variables that the nodes would have.

    Returns
    -------
    dict
        Empty unless they ask for UDP on the loopback of Fast DDS.

    """
    if (environment.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') != 'rmw_fastrtps_cpp'
            or environment.get('ROS_AUTOMATIC_DISCOVERY_RANGE') != 'LOCALHOST'
            or environment.get('FASTDDS_BUILTIN_TRANSPORTS') != 'UDPv4'
            or any(environment.get(p) for p in PROFILES)):
        return {}
    return {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SYSTEM_DEFAULT',
            PROFILES[0]: str(packaged('loopback_udp.xml'))}
