"""Play a recorded bag and identify its modes again; the end of the bag ends it."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown, TimerAction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

LAST_WINDOWS_S = 5.0          # so long the identifier may work on when the bag has ended


def value(argument, kind):
    """Return an argument as a parameter of one type: a rate of 10 is 10.0, a bag 7 a name."""
    return ParameterValue(LaunchConfiguration(argument), value_type=kind)


def generate_launch_description():
    """Return player and identifier."""
    config = PathJoinSubstitution([FindPackageShare('ssi_ros'), 'config'])
    return LaunchDescription([
        DeclareLaunchArgument('bag', description='the bag to play'),
        DeclareLaunchArgument('rate', default_value='1.0',
                              description='seconds of the bag a second; the player waits for the '
                              'identifier where it cannot follow'),
        DeclareLaunchArgument('loop', default_value='false', description='begin anew at the end'),
        # reliable: the player waits for the identifier, and no sample is lost at any rate; a
        # process that stood still hears its channels one after the other, hence lateness_s
        Node(package='ssi_ros', executable='identifier_node', name='identifier', output='screen',
             parameters=[PathJoinSubstitution([config, 'identifier.yaml']),
                         {'use_sim_time': True, 'reliable': True, 'lateness_s': 60.0}]),
        Node(package='ssi_ros', executable='player_node', name='player', output='screen',
             parameters=[PathJoinSubstitution([config, 'player.yaml']),
                         {'bag': value('bag', str), 'wait_for_subscribers': 1,
                          'rate': value('rate', float), 'reliable': True,
                          'topics': ['/accelerometer/.*'],
                          'loop': value('loop', bool)}],
             on_exit=TimerAction(period=LAST_WINDOWS_S, actions=[
                 Shutdown(reason='the player has ended')])),
    ])
