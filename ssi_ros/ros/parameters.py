"""
Quantities of a record as ROS parameters: one declaration, descriptor and range included.

A node's settings are a frozen record declared with `quantity`. The functions here declare it,
read it back, and answer a change with the range that is allowed.
"""
from dataclasses import replace
import math

from rcl_interfaces.msg import (
    FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType, SetParametersResult)
from rclpy.parameter import Parameter
from ssi_ros.quantity import check_value, quantities, unknown

WHOLE_LIMIT = 2 ** 31 - 1


def declare(node, cls, defaults=None):
    """
    Declare every quantity of the record class `cls` on the node.

    Parameters
    ----------
    node : rclpy.node.Node
        The node.
    cls : type
        A frozen dataclass declared with `quantity`.
    defaults : cls, optional
        A record that replaces the declared defaults.

    """
    for f in quantities(cls):
        value = f.default if defaults is None else getattr(defaults, f.name)
        if not node.has_parameter(f.name):
            node.declare_parameter(f.name, _to_ros(value), _descriptor(f))


def read(node, cls):
    """
    Read the record back from the node's parameters.

    Raises
    ------
    ValueError
        For a value out of range, with the range.

    """
    values = {f.name: _from_ros(f, node.get_parameter(f.name).value) for f in quantities(cls)}
    return cls(**values)


def changed(record, parameters, restarts=False):
    """
    Return the record with the changes asked for.

    Parameters
    ----------
    record : frozen dataclass
        The settings in force.
    parameters : list of rclpy.parameter.Parameter
        The changes; names that are not the record's are left out.
    restarts : bool
        Whether what runs on the record is started anew, so that it can take any change.

    Raises
    ------
    ValueError
        For a value out of range, or one that only a new start can take.

    """
    known = {f.name: f for f in quantities(record)}
    new = {}
    for p in parameters:
        if p.name in known:
            f = known[p.name]
            value = _from_ros(f, p.value)
            if not (f.metadata['live'] or restarts) and value != getattr(record, p.name):
                raise ValueError(f'{p.name} cannot change while the node is configured; '
                                 'deactivate and clean up first, or set it at the start')
            new[p.name] = value
    return replace(record, **new)


def check_known(node):
    """
    Check that every parameter given at the start is one that the node has.

    Raises
    ------
    ValueError
        With the names that are near.

    """
    # rclpy offers no public way to ask what was given but not declared
    for name in node._parameter_overrides:
        if not node.has_parameter(name) and not name.startswith('qos_overrides.'):
            known = [p for p in node._parameters if not p.startswith('qos_overrides.')]
            raise ValueError(unknown(f'parameter {name}', name, known))


def answer(function):
    """Make a parameter callback of `function(parameters)`: a ValueError becomes the reason."""
    def callback(parameters):
        try:
            function(parameters)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)
    return callback


def _to_ros(value):
    if isinstance(value, tuple):
        return list(value) if value else Parameter.Type.STRING_ARRAY
    return value


def _from_ros(f, value):
    if isinstance(f.default, tuple):
        value = tuple(value or ())
        for v in value:
            check_value(f, v)
        return value
    if isinstance(f.default, float) and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    check_value(f, value)
    return value


def _descriptor(f):
    meta, sample = f.metadata, f.default
    unit = '' if meta['unit'] == '1' else f' [{meta["unit"]}]'
    d = ParameterDescriptor(name=f.name, description=meta['doc'] + unit,
                            read_only=False, dynamic_typing=False)
    if isinstance(sample, bool) or isinstance(sample, (str, tuple)):
        if isinstance(sample, tuple):
            d.type = ParameterType.PARAMETER_STRING_ARRAY
        return d
    low, high = meta['low'], meta['high']
    if isinstance(sample, int):
        low = max(low, -WHOLE_LIMIT)
        high = min(high, WHOLE_LIMIT)
        d.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=0)]
    else:
        # YAML `200` for a double parameter is an integer to ROS; let it be one (see _from_ros)
        d.dynamic_typing = True
        if math.isfinite(low) or math.isfinite(high):
            d.floating_point_range = [FloatingPointRange(
                from_value=max(low, -1.7e308), to_value=min(high, 1.7e308), step=0.0)]
    return d
