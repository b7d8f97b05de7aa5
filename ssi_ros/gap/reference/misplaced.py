"""Where the fit of a channel that sees the modes otherwise shall begin, eq. (181)."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.reference.forms import mode_picks

RIDGE = 1e-6            # of the largest weight of a mode: one that no band holds stays


def begun(nominal, form, seen):
    """
    Return the form of a channel that sees modes otherwise, begun at what cross spectra say.

    The other channels stay, so that the cross spectra of this one with them are linear in its row,
    however far it moved, and its noise is not in them.

    Parameters
    ----------
    nominal : Nominal
        The reference.
    form : Form
        Of `sensor_misplacement`.
    seen : ndarray, shape (b, l, l)
        Mean spectrum of the record.

    Returns
    -------
    Form

    """
    c = nominal.channels.index(form.place['channel'])
    others = [k for k in range(len(nominal.channels)) if k != c]
    grid = np.ix_(np.arange(nominal.cut.bands), others, others)
    usual = nominal.spectrum
    inverse = np.linalg.inv(usual[grid])
    # their level, without the channel in doubt
    level = np.median(np.einsum('bij,bji->b', inverse, seen[grid]).real / len(others))
    missing = seen[:, c][:, others] / level - usual[:, c][:, others]
    # what a mode more of it would add: rows of spectra without the noise of the others
    clean = usual - np.diag(nominal.floor)
    rows = np.einsum('mbi,bij->mbj', mode_picks(nominal), clean)[:, :, others]
    root = np.linalg.cholesky(inverse) * np.sqrt(
        nominal.trust / usual[:, c, c].real)[:, None, None]
    target = np.einsum('bj,bjk->bk', missing, root).reshape(-1)
    rows = np.einsum('mbj,bjk->mbk', rows, root).reshape(len(rows), -1)
    normal = (rows.conj() @ rows.T).real
    normal += RIDGE * np.diag(normal).max() * np.eye(len(normal))
    return replace(form, begin=np.linalg.solve(normal, (rows.conj() @ target).real))
