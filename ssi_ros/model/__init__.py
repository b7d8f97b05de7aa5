"""
The spacecraft model: numbers -> system -> samples.

Names are imported when they are first used, so that `import ssi_ros.model` costs nothing.
"""
from ssi_ros.lazy import first_used

_HOME = {
    'Spacecraft': 'spacecraft', 'load_spacecraft': 'spacecraft', 'save_spacecraft': 'spacecraft',
    'assemble': 'structure', 'displacement_row': 'structure', 'add_point_mass': 'structure',
    'System': 'system', 'NaturalModes': 'system', 'natural_modes': 'system',
    'StateSpace': 'statespace', 'simulate': 'simulator', 'stream': 'simulator',
    'ensemble': 'simulator', 'LinearModel': 'linear_model', 'modal_model': 'linear_model',
    'state_space_model': 'linear_model', 'Channel': 'linear_model', 'Input': 'linear_model',
    'load_model': 'model_file', 'save_model': 'model_file',
}
__all__ = sorted(_HOME)
__getattr__ = first_used(__name__, _HOME)
