"""Watch the gap to the model, live or on a replayed bag, beside the modes."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import (LaunchConfiguration, NotEqualsSubstitution,
                                  PathJoinSubstitution, PythonExpression)
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
    """Return gap node and identifier, with a player if a bag is given."""
    config = PathJoinSubstitution([FindPackageShare('ssi_ros'), 'config'])
    with_bag = NotEqualsSubstitution(LaunchConfiguration('bag'), '')
    # from a bag: reliable, so that the player waits for both and no sample is lost; a process
    # that stood still hears its channels one after the other, hence lateness_s
    source = {'use_sim_time': chosen('use_sim_time', with_bag),
              'reliable': chosen('reliable', with_bag),
              'lateness_s': ParameterValue(PythonExpression([
                  "60.0 if '", with_bag, "'.lower() == 'true' else 1.0"]), value_type=float)}

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
        DeclareLaunchArgument('bag', default_value='', description='the bag to play, if any'),
        DeclareLaunchArgument('use_sim_time', default_value='auto',
                              description='true (with /clock), false, or auto: true with a bag'),
        DeclareLaunchArgument('reliable', default_value='auto',
                              description='subscribe reliable: true, false (most sensors), or '
                              'auto: true with a bag'),
        DeclareLaunchArgument('rate', default_value='1.0',
                              description='seconds of the bag a second; the player waits for '
                              'nodes that cannot follow'),
        node('gap', source, {'model': value('model', str),
                             'window_s': value('window_s', float),
                             'hop_s': value('hop_s', float),
                             'false_alarm_every_s': value('false_alarm_every_s', float)}),
        node('identifier', source),
        node('player', {'bag': value('bag', str), 'wait_for_subscribers': 2,
                        'rate': value('rate', float), 'reliable': True,
                        'topics': ['/accelerometer/.*']},
             condition=IfCondition(with_bag)),
    ])
