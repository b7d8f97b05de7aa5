"""Play a recorded bag and identify its modes again."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return player and identifier."""
    config = PathJoinSubstitution([FindPackageShare('ssi_ros'), 'config'])
    return LaunchDescription([
        DeclareLaunchArgument('bag', description='the bag to play'),
        DeclareLaunchArgument('rate', default_value='1.0',
                              description='seconds of the bag a second'),
        DeclareLaunchArgument('loop', default_value='false', description='begin anew at the end'),
        Node(package='ssi_ros', executable='identifier_node', name='identifier', output='screen',
             parameters=[PathJoinSubstitution([config, 'identifier.yaml']),
                         {'use_sim_time': True}]),
        Node(package='ssi_ros', executable='player_node', name='player', output='screen',
             parameters=[PathJoinSubstitution([config, 'player.yaml']),
                         {'bag': LaunchConfiguration('bag'), 'wait_for_subscribers': 1,
                          'rate': LaunchConfiguration('rate'),
                          'topics': ['/accelerometer/.*'],
                          'loop': LaunchConfiguration('loop')}]),
    ])
