"""
Write the reference pages of the documentation from the code itself.

`python -m ssi_ros.ros.reference docs/reference` writes topics, parameters and verbs anew; a test
holds them against the code. Topics are not written down anywhere: every node is configured, and
asked for what it has opened.
"""
import argparse
from pathlib import Path
import re
import sys
import tempfile

import rclpy
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from ssi_ros.cli.main import parser, verbs
from ssi_ros.quantity import quantities
from ssi_ros.ros.config_files import NODES

BAG = Path(__file__).resolve().parents[2] / 'bags' / 'ambient'
MADE = 'Made by `python -m ssi_ros.ros.reference docs/reference` from the code; do not edit.'
OF_ROS = re.compile(r'.*/(get_parameters|set_parameters|set_parameters_atomically|list_parameters|'
                    r'describe_parameters|get_parameter_types|change_state|get_state|'
                    r'get_available_states|get_available_transitions|get_transition_graph|'
                    r'get_type_description|transition_event)$|/rosout$|/parameter_events$')


def _needed(name, folder):
    """Return the parameters without which a node cannot be configured."""
    return {'player': {'bag': str(BAG)}, 'recorder': {'bag': str(folder / 'bag')},
            'bridge': {'port': 0}}.get(name, {})


def topics():
    """Return the page of topics and services."""
    lines = ['# Topics and services', '', MADE, '',
             'Names as they stand without a namespace and a remapping; `~` is the name of the '
             'node. The player shows the topics of the bag that is played, here `bags/ambient`; '
             'recorder and bridge join the topics that they are told to. Every node has besides '
             'these the services of a lifecycle node.']
    with tempfile.TemporaryDirectory() as folder:
        for name, node_class in NODES.items():
            given = [Parameter(k, value=v) for k, v in _needed(name, Path(folder)).items()]
            node = node_class(parameter_overrides=given)
            try:
                node.trigger_configure()
                lines += _of_node(name, node)
            finally:
                node.trigger_shutdown()
                node.destroy_node()
    return '\n'.join(lines) + '\n'


def _of_node(name, node):
    own = re.compile(rf'^/{name}/')
    rows = []
    for way, found in (('out', node.publishers), ('in', node.subscriptions)):
        for end in found:
            rows.append((own.sub('~/', end.topic_name), way, _type(end.msg_type),
                         _qos(end.qos_profile)))
    rows += [(own.sub('~/', s.service_name), 'service', _type(s.srv_type), '')
             for s in node.services]
    rows = sorted({r for r in rows if not OF_ROS.match(r[0])}, key=lambda r: (r[1], r[0]))
    lines = ['', f'## {name}', '', ' '.join((node.__class__.__doc__ or '').split()), '',
             '| name | | type | quality of service |', '|---|---|---|---|']
    return lines + [f'| `{a}` | {b} | `{c}` | {d} |' for a, b, c, d in rows]


def _type(message_class):
    package, kind = message_class.__module__.split('.')[:2]
    return f'{package}/{kind}/{message_class.__name__}'


def _qos(profile):
    reliable = 'reliable' if profile.reliability == ReliabilityPolicy.RELIABLE else 'best effort'
    latched = ', latched' if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL else ''
    return f'{reliable}, depth {profile.depth}{latched}'


def parameters():
    """Return the page of parameters."""
    lines = ['# Parameters', '', MADE, '',
             'Every node also has `autostart` (true) and, from ROS, `use_sim_time`. The files '
             '`config/<node>.yaml` hold the same defaults.']
    for name, node_class in NODES.items():
        lines += ['', f'## {name}', '', '| parameter | default | range | unit | meaning |',
                  '|---|---|---|---|---|']
        for cls in node_class.settings_classes:
            for f in quantities(cls):
                meta, words = f.metadata, not isinstance(f.default, (int, float))
                span = '' if words or isinstance(f.default, bool) else (
                    f'{meta["low"]:g} to {meta["high"]:g}')
                unit = '' if words or meta['unit'] == '1' else meta['unit']
                doc = meta['doc'].replace('|', r'\|') + ('' if meta['live'] else
                                                         '; set at the start')
                if not meta['live'] and cls in node_class.restarting_classes:
                    doc = doc.replace('set at the start', 'a change begins the window anew')
                lines.append(f'| `{f.name}` | {_default(f.default)} | {span} | {unit} | {doc} |')
    return '\n'.join(lines) + '\n'


def _default(value):
    if isinstance(value, tuple):
        return '<br>'.join(f'`{v}`' for v in value if v) or 'none'
    return f'`{value}`' if value != '' else 'none'


def verbs_page():
    """Return the page of verbs."""
    top = parser()
    own = next(a for a in top._actions if isinstance(a, argparse._SubParsersAction)).choices
    lines = ['# Verbs', '', MADE, '',
             'Exit codes: 0 done, 1 a negative answer, 2 it cannot be done (one line on stderr '
             'says why and what to do).']
    for name, module in verbs().items():
        lines += ['', f'## {name}', '', module.__doc__.strip(), '', '```sh', module.EXAMPLE,
                  '```', '', '| option | meaning |', '|---|---|']
        for action in own[name]._actions:
            if isinstance(action, argparse._HelpAction):
                continue
            words = ', '.join(action.option_strings) or action.metavar or action.dest
            if action.option_strings and action.nargs != 0:
                words += ' ' + str(action.metavar or (
                    '{' + ','.join(map(str, action.choices)) + '}' if action.choices
                    else action.dest.upper()))
            meaning = ' '.join((action.help or '').replace('%%', '%').split())
            lines.append(f'| `{words}` | {meaning} |')
    return '\n'.join(lines) + '\n'


def pages():
    """Return the text of every page by file name."""
    return {'topics.md': topics(), 'parameters.md': parameters(), 'verbs.md': verbs_page()}


def main(folder):
    """Write all pages."""
    rclpy.init()
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        for name, text in pages().items():
            (Path(folder) / name).write_text(text)
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main(sys.argv[1])
