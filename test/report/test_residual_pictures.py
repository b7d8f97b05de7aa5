"""Residuals of a calibrated model are drawn over the time of every recording."""
import numpy as np
from ssi_ros.model import assemble, load_spacecraft, simulate
from ssi_ros.report.gap_view import gap_view
from ssi_ros.report.residual_pictures import residual_section


def test_a_row_a_recording():
    """Two curves a recording; beside the model that made it they stay near 1."""
    craft = load_spacecraft()
    recordings = [simulate(assemble(craft), 60.0, seed) for seed in (1, 2)]
    section = residual_section(['one', 'two'], [2 * [gap_view(craft, r)] for r in recordings])
    curves = section.pictures[0].figure.data
    assert len(curves) == 4
    for curve in curves:
        assert len(curve.x) == len(curve.y) > 2
        assert np.abs(np.array(curve.y) - 1.0).max() < 0.3
