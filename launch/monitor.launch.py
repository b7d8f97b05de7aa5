"""Simulate a spacecraft, identify its modes live, record everything to MCAP."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import (LaunchConfiguration, NotEqualsSubstitution,
                                  PathJoinSubstitution)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def value(argument, kind):
    """Return an argument as a parameter of one type: a rate of 10 is 10.0, a bag 7 a name."""
    return ParameterValue(LaunchConfiguration(argument), value_type=kind)


def generate_launch_description():
    """Return simulator, identifier and recorder with their configuration files."""
    config = PathJoinSubstitution([FindPackageShare('ssi_ros'), 'config'])
    sim_time = {'use_sim_time': value('use_sim_time', bool)}

    def node(name, *more, **keywords):
        settings = PathJoinSubstitution([config, f'{name}.yaml'])
        return Node(package='ssi_ros', executable=f'{name}_node', name=name, output='screen',
                    parameters=[settings, *more], **keywords)

    return LaunchDescription([
        DeclareLaunchArgument('speed', default_value='1.0',
                              description='simulated seconds a second'),
        DeclareLaunchArgument('use_sim_time', description='true with a speed other than 1',
                              default_value=NotEqualsSubstitution(
                                  LaunchConfiguration('speed'), '1.0')),
        DeclareLaunchArgument('bag', default_value='', description='folder of the new bag'),
        DeclareLaunchArgument('simulate', default_value='true',
                              description='false to watch real accelerometers'),
        node('simulator', {'speed': value('speed', float)},
             condition=IfCondition(LaunchConfiguration('simulate'))),
        node('identifier', sim_time),
        node('recorder', sim_time, {'bag': value('bag', str)}),
    ])
