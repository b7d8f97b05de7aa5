"""Where a gap lies, by the candidates and by what contradicts them."""
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.gap.selection.conclusion import _sites
from ssi_ros.gap.selection.evidence import Ranked


@pytest.mark.parametrize('left, expected', [(None, 'sensor'), ('structure', 'structure')])
def test_a_fit_that_moves_no_mode_does_not_speak_for_its_site(left, expected):
    """Where modes moved for certain, noise of a sensor that is nearest says nothing of where."""
    candidate = SimpleNamespace(names=('sensor_noise',), equivalents=())
    case = SimpleNamespace(comparison=SimpleNamespace(elsewhere=lambda fit: left))
    found = _sites(case, [Ranked(SimpleNamespace(candidate=candidate))], np.array([0.1]))
    assert found[expected] == 1.0
