"""Simulate a spacecraft, identify its modes live, record everything to MCAP."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return simulator, identifier and recorder with their configuration files."""
    config = PathJoinSubstitution([FindPackageShare('ssi_ros'), 'config'])
    speed = LaunchConfiguration('speed')
    sim_time = {'use_sim_time': LaunchConfiguration('use_sim_time')}

    def node(name, *more, **keywords):
        settings = PathJoinSubstitution([config, f'{name}.yaml'])
        return Node(package='ssi_ros', executable=f'{name}_node', name=name, output='screen',
                    parameters=[settings, *more], **keywords)

    return LaunchDescription([
        DeclareLaunchArgument('speed', default_value='1.0',
                              description='simulated seconds a second'),
        DeclareLaunchArgument('use_sim_time', default_value='false',
                              description='true with a speed other than 1'),
        DeclareLaunchArgument('bag', default_value='', description='folder of the new bag'),
        DeclareLaunchArgument('simulate', default_value='true',
                              description='false to watch real accelerometers'),
        node('simulator', {'speed': speed},
             condition=IfCondition(LaunchConfiguration('simulate'))),
        node('identifier', sim_time),
        node('recorder', sim_time, {'bag': LaunchConfiguration('bag')}),
    ])
