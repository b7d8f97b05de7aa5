"""Watch the gap to the model, live or on a replayed bag, beside the modes."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return gap node and identifier, with a player if a bag is given."""
    config = PathJoinSubstitution([FindPackageShare('ssi_ros'), 'config'])
    sim_time = {'use_sim_time': LaunchConfiguration('use_sim_time')}
    bag = LaunchConfiguration('bag')

    def node(name, *more, **keywords):
        settings = PathJoinSubstitution([config, f'{name}.yaml'])
        return Node(package='ssi_ros', executable=f'{name}_node', name=name, output='screen',
                    parameters=[settings, *more], **keywords)

    return LaunchDescription([
        DeclareLaunchArgument('model', default_value='',
                              description='spacecraft YAML; empty = the packaged one'),
        DeclareLaunchArgument('window_s', default_value='600.0',
                              description='window of the gap meter'),
        DeclareLaunchArgument('hop_s', default_value='30.0',
                              description='a result every so often'),
        DeclareLaunchArgument('false_alarm_every_s', default_value='2592000.0',
                              description='least mean time between false alarms'),
        DeclareLaunchArgument('use_sim_time', default_value='false',
                              description='true for a bag or a simulator with /clock'),
        DeclareLaunchArgument('bag', default_value='', description='the bag to play, if any'),
        DeclareLaunchArgument('rate', default_value='1.0',
                              description='seconds of the bag a second'),
        node('gap', sim_time, {'model': LaunchConfiguration('model'),
                               'window_s': LaunchConfiguration('window_s'),
                               'hop_s': LaunchConfiguration('hop_s'),
                               'false_alarm_every_s': LaunchConfiguration('false_alarm_every_s')}),
        node('identifier', sim_time),
        node('player', {'bag': bag, 'wait_for_subscribers': 2,
                        'rate': LaunchConfiguration('rate'), 'topics': ['/accelerometer/.*']},
             condition=IfCondition(PythonExpression(["'", bag, "' != ''"]))),
    ])
