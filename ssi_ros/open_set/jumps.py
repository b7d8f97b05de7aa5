"""Numbers that jump: a stiffness, a damping or a gain that is another one from some time on."""
import numpy as np

from ssi_ros.open_set.products import named, two_sided

TIMES = 37              # at which a jump is tried
EDGE = 0.05             # of the record at both ends, in which none is
INDEPENDENT = 14.0      # jumps among them, where scores are large: of white noise


def jump(products):
    """Return p-value and text of the clearest jump of any Product."""
    share = np.linspace(EDGE, 1 - EDGE, TIMES)
    # a jump near an end rests on the few values beyond it
    few = 4 * share * (1 - share)
    z = np.array([p.deviations((np.arange(p.samples) / p.samples >= share[:, None]).astype(float),
                               few) for p in products])
    which, at = np.unravel_index(np.argmax(np.abs(z)), z.shape)
    p_value = two_sided(z, len(products) * INDEPENDENT)
    return p_value, (f'{named(products, z[:, at] ** 2)} jumps at about '
                     f'{share[at] * products[which].duration_s:.0f} s')
