"""The quantities of a candidate as a diagnosis says them."""
import numpy as np
from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.comparison import Fit
from ssi_ros.gap.nominal.model_answer import parameters
from ssi_ros.gap.selection.evidence import Ranked


def test_intervals_stay_within_what_a_quantity_can_be():
    """A damping ratio that the record does not determine is not negative, nor above its range."""
    candidate = Candidate((parse_effect(
        'attitude_controller:bandwidth_hz=0.1,damping_ratio=0.7'),))
    fit = Fit(candidate, np.array(candidate.point()), np.diag([0.1, 4.0]) ** 2, 0.0, np.ones(3))
    found = parameters(Ranked(fit), ())
    ratio, bandwidth = (found[f'attitude_controller.{n}'] for n in (
        'damping_ratio', 'bandwidth_hz'))
    assert (ratio.low90, ratio.value, ratio.high90, ratio.std) == (0.01, 0.7, 5.0, 4.0)
    assert bandwidth.high90 / bandwidth.value == np.exp(0.1645)
