"""Nodes that are started together talk over UDP on the loopback, and through nothing else."""
from pathlib import Path

from geometry_msgs.msg import AccelStamped
import pytest
from ssi_ros.ros.loopback import udp_alone

ASKED = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}


def test_no_shared_memory_and_no_network(bench):
    """No thread of shared memory, all sockets on 127.0.0.1, and samples come."""
    came = bench.collect(AccelStamped, '/accelerometer/e1_b')
    bench.processes.start('simulator', 'simulator', reliable=True)
    bench.wait(lambda: len(came) > 10)
    folder = Path(f'/proc/{bench.processes.running["simulator"].pid}')
    threads = {(t / 'comm').read_text().strip() for t in (folder / 'task').iterdir()}
    assert any(t.startswith('dds.udp.') for t in threads), threads
    assert not [t for t in threads if t.startswith('dds.shm')], threads
    links = [str(f.readlink()) for f in (folder / 'fd').iterdir()]
    own = {k.removeprefix('socket:[').rstrip(']') for k in links if k.startswith('socket:[')}
    table = [line.split() for line in (folder / 'net/udp').read_text().splitlines()[1:]]
    places = [row[1] for row in table if row[9] in own]
    # 127.0.0.1, in little-endian order
    assert places and all(p.startswith('0100007F:') for p in places), places


@pytest.mark.parametrize('more', (
    {'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'}, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'},
    {'FASTDDS_BUILTIN_TRANSPORTS': 'SHM'}, {'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}))
def test_what_was_chosen_stays(more):
    """Another middleware, range, transport or profile is that of the user."""
    assert udp_alone(ASKED)['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SYSTEM_DEFAULT'
    assert udp_alone({**ASKED, **more}) == {}
