"""Residuals of a calibrated model are drawn over the time of every recording."""
from types import SimpleNamespace

import numpy as np
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import assemble, load_spacecraft, simulate
from ssi_ros.report.residual_pictures import residual_section


def test_a_row_a_recording():
    """Two curves a recording; beside the model that made it they stay near 1."""
    craft = load_spacecraft()
    recordings = [simulate(assemble(craft), 60.0, seed) for seed in (1, 2)]
    section = residual_section(SimpleNamespace(spacecraft=craft), craft, recordings,
                               ['one', 'two'], DiagnosisSettings(), ())
    curves = section.pictures[0].figure.data
    assert len(curves) == 4
    for curve in curves:
        assert len(curve.x) == len(curve.y) > 2
        assert np.abs(np.array(curve.y) - 1.0).max() < 0.3
