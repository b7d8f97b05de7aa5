"""Windows of modes as plain data in the fixed form `ssi_ros/modes/1`, which others read."""
import math

SCHEMA = 'ssi_ros/modes/1'


def modes_json(windows, first_ns):
    """
    Return windows as plain data, ready for `json.dumps`.

    Parameters
    ----------
    windows : iterable of WindowModes
        The windows.
    first_ns : int
        The bag's first stamp [ns], from which the times count.

    Returns
    -------
    dict
        schema, windows: start_s, end_s, modes, reason. A spread that is not known is null.

    """
    return {'schema': SCHEMA, 'windows': [_window(w, first_ns) for w in windows]}


def _window(window, first_ns):
    return {'start_s': (window.start_ns - first_ns) / 1e9,
            'end_s': (window.end_ns - first_ns) / 1e9,
            'modes': [_mode(m) for m in window.modes],
            'reason': window.reason}


def _mode(mode):
    return {'id': mode.identity, 'label': mode.label,
            'frequency_hz': float(mode.frequency_hz),
            'frequency_std_hz': _finite(mode.frequency_std_hz),
            'damping_ratio': float(mode.damping_ratio),
            'damping_ratio_std': _finite(mode.damping_ratio_std),
            'shape': [[z.real, z.imag] for z in mode.shape.tolist()]}


def _finite(value):
    return float(value) if math.isfinite(value) else None
