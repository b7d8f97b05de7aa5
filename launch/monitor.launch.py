"""Simulate a spacecraft, identify its modes live, record everything to MCAP."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def value(argument, kind):
    """Return an argument as a parameter of one type: a rate of 10 is 10.0, a bag 7 a name."""
    return ParameterValue(LaunchConfiguration(argument), value_type=kind)


def chosen(argument, *auto):
    """Return a flag: true or false as given; what `auto` says where that is given."""
    given = LaunchConfiguration(argument)
    return ParameterValue(PythonExpression([
        "'", given, "'.lower() == 'true' or ('", given, "'.lower() == 'auto' and '", *auto,
        "'.lower() == 'true')"]), value_type=bool)


def generate_launch_description():
    """Return simulator, identifier and recorder with their configuration files."""
    config = PathJoinSubstitution([FindPackageShare('ssi_ros'), 'config'])
    other_pace = PythonExpression(['float(', LaunchConfiguration('speed'), ') != 1.0'])
    sim_time = {'use_sim_time': chosen('use_sim_time', other_pace)}
    # what is simulated here is published reliable, and starts when both readers are there
    from_simulator = {'reliable': value('simulate', bool)}

    def node(name, *more, **keywords):
        settings = PathJoinSubstitution([config, f'{name}.yaml'])
        return Node(package='ssi_ros', executable=f'{name}_node', name=name, output='screen',
                    parameters=[settings, *more], **keywords)

    return LaunchDescription([
        DeclareLaunchArgument('speed', default_value='1.0',
                              description='simulated seconds a second'),
        DeclareLaunchArgument('use_sim_time', default_value='auto',
                              description='true, false, or auto: true with a speed other than 1'),
        DeclareLaunchArgument('bag', default_value='',
                              description='folder of the new bag; empty: recording_<date>'),
        DeclareLaunchArgument('simulate', default_value='true',
                              description='false to watch real accelerometers'),
        node('simulator', {'speed': value('speed', float), 'reliable': True,
                           'wait_for_subscribers': 2},
             condition=IfCondition(LaunchConfiguration('simulate'))),
        node('identifier', sim_time, from_simulator),
        node('recorder', sim_time, {'bag': value('bag', str)},
             on_exit=Shutdown(reason='the recorder has ended: nothing goes on unrecorded')),
    ])
