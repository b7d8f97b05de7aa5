"""What a candidate's freedom costs."""
import numpy as np

from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.rank import occam


def test_a_size_that_is_not_seen_is_less_likely_than_none():
    """A hinge that rubs unseen must not tie with the plain hinge that it is then, eq. (112)."""
    plain = Candidate((parse_effect('hinge_compliance:stiffness_n_m_rad=1e5'),))
    rubs = Candidate((parse_effect('hinge_friction:torque_n_m=0.01,stiffness_n_m_rad=1e5'),))
    seen, unseen = 0.01 ** 2, 100.0 ** 2
    assert [f.name for _, f in rubs.numbers()] == ['torque_n_m', 'stiffness_n_m_rad']
    cost = occam(rubs, np.diag([unseen, seen])) - occam(plain, np.diag([seen]))
    # a fifth of sizes is not seen; the stiffness, no size there, has a narrower prior
    assert cost < np.log(0.3)
