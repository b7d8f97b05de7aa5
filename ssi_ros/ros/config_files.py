"""
Write the parameter files in `config/` from the settings' own declarations.

`python -m ssi_ros.ros.config_files config` writes them anew; a test holds them against the code.
"""
from pathlib import Path
import sys

from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.quantity import quantities
from ssi_ros.ros.bridge_node import BridgeNode
from ssi_ros.ros.gap_node import GapNode
from ssi_ros.ros.identifier_node import IdentifierNode
from ssi_ros.ros.player_node import PlayerNode
from ssi_ros.ros.recorder_node import RecorderNode
from ssi_ros.ros.simulator_node import SimulatorNode
import yaml

NODES = {'simulator': SimulatorNode, 'identifier': IdentifierNode,
         'recorder': RecorderNode, 'player': PlayerNode, 'bridge': BridgeNode,
         'gap': GapNode}


def parameter_file(node):
    """Return the text of a node's parameter file: every parameter, its range and its meaning."""
    lines = [f'# Parameters of the {node} node; each line holds the default.',
             f'{node}:', '  ros__parameters:']
    for cls in NODES[node].settings_classes:
        for f in quantities(cls):
            meta = f.metadata
            span = ''
            if isinstance(f.default, (int, float)) and not isinstance(f.default, bool):
                span = f' [{meta["unit"]}] {meta["low"]:g} to {meta["high"]:g}'
            fixed = '' if meta['live'] else '; set at the start'
            if fixed and cls in NODES[node].restarting_classes:
                fixed = '; a change begins the window anew'
            lines += [f'    # {meta["doc"]}{span}{fixed}',
                      f'    {f.name}: {_yaml(f.default)}']
    return '\n'.join(lines) + '\n'


def diagnosis_file():
    """Return the text of the settings of a diagnosis: every setting, its unit and its meaning."""
    lines = ['# Settings of `ssi_ros diagnose`; each line holds the default.']
    for f in quantities(DiagnosisSettings):
        unit = f.metadata['unit']
        lines += [f'# {f.metadata["doc"]}' + (f' [{unit}]' if unit not in ('', '1') else ''),
                  f'{f.name}: {_yaml(f.default)}']
    return '\n'.join(lines) + '\n'


def _yaml(value):
    if isinstance(value, tuple):
        return '[' + ', '.join(_yaml(v) for v in value) + ']'
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    return yaml.safe_dump(value).split('\n')[0]


def main(folder):
    """Write all files."""
    for node in NODES:
        (Path(folder) / f'{node}.yaml').write_text(parameter_file(node))
    (Path(folder) / 'diagnosis.yaml').write_text(diagnosis_file())


if __name__ == '__main__':
    main(sys.argv[1])
