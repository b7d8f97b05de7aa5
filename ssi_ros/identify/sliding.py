"""
SSI-COV of one order on a sliding window, warm-started: the least that an update can cost.

A hop changes the covariances of a long window by little, so the leading subspace of the window
before is a near solution: one block power step and a Rayleigh-Ritz projection renew it. Where the
angle to it says that it is not, the whole decomposition is taken.
"""
import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dgeqrf, dorgqr

from ssi_ros.identify.lags import Ring
from ssi_ros.identify.realise import decompose, factors_of, noise_floor, poles_of, weighted, whiten
from threadpoolctl import ThreadpoolController

BLAS = ThreadpoolController()
CLEAR = 1.3             # times the edge of the noise: below it triplets change by themselves
EXTRA = 8               # columns beyond the order: the leading ones converge the faster
LACK = 3e-3             # sine of the angle that may remain, where noise does not reach
FAR = 0.6               # a start that lacked so much is none
STEPS = 2               # power steps before the whole decomposition


class SlidingSsiCov:
    """
    Poles of one model order on sliding windows.

    Parameters
    ----------
    channels : int
        Number of channels l.
    rate_hz : float
        Sampling rate [Hz].
    window_s, hop_s : float
        Length of the window and time between two results [s]; the window is a whole number of
        hops.
    block_rows : int
        Block rows i.
    order : int
        Model order n.
    weighting : str
        'cva' or 'upc'.

    Attributes
    ----------
    warm, whole : int
        How many windows were renewed and how many were decomposed as a whole.

    Raises
    ------
    ValueError
        Where the window is too short or the order too high.

    """

    def __init__(self, channels, rate_hz, window_s, hop_s, block_rows=50, order=40,
                 weighting='cva'):
        hops = round(window_s / hop_s)
        if hops < 1 or abs(window_s / hop_s - hops) > 1e-6 * hops:
            raise ValueError(f'window_s={window_s:g} must be a whole number of hops of '
                             f'hop_s={hop_s:g}')
        if window_s * rate_hz < 4 * block_rows:
            raise ValueError(f'window_s={window_s:g} holds {window_s * rate_hz:.0f} samples; '
                             f'block_rows={block_rows} needs {4 * block_rows} or more')
        if not 1 <= order <= (block_rows - 1) * channels:
            raise ValueError(f'order={order} given; 1 to {(block_rows - 1) * channels} = '
                             '(block_rows - 1) * channels are possible')
        self.rate_hz, self.hop_s = float(rate_hz), float(hop_s)
        self.rows, self.order, self.weighting = block_rows, order, weighting
        self.ring = Ring(hops, 2 * block_rows - 1, channels)
        self.waiting = np.empty((0, channels))
        self.right, self.warm, self.whole = None, 0, 0

    def push(self, values):
        """
        Take rows; return the poles of every window that they complete.

        Parameters
        ----------
        values : ndarray, shape (n, l)
            NaN where a sample is missing.

        Returns
        -------
        list of Poles
            One a hop, once the window is full.

        """
        self.waiting = np.concatenate([self.waiting, values])
        out = []
        with BLAS.limit(limits=1):
            while len(self.waiting) >= (size := self._row(self.ring.pushed + 1)
                                        - self._row(self.ring.pushed)):
                self.ring.push(self.waiting[:size])
                self.waiting = self.waiting[size:]
                if self.ring.full:
                    out.append(self._poles())
        return out

    def _row(self, hop):
        return round(hop * self.hop_s * self.rate_hz)

    def _poles(self):
        covariances = self.ring.covariances(self.hop_s)
        t, w = weighted(covariances.values, self.rows, self.weighting)
        floor = CLEAR * noise_floor(self.rows, covariances.values.shape[1], covariances.counts)
        found = self._renewed(t, w, floor)
        if found is None:
            self.whole += 1
            found = decompose(whiten(t, w), self.order + EXTRA)
        else:
            self.warm += 1
        u, s, v = found
        self.right = v
        n = self.order
        factors = factors_of(u[:, :n], s[:n], None, w, covariances.values.shape[1])
        return poles_of(factors, [min(n, len(s))], self.rate_hz, covariances.scale,
                        vectors=False)[0]

    def _renewed(self, t, w, floor):
        """
        Return the leading singular triplets near those of the window before, or None.

        Only triplets above the noise must have converged: those below change from window to
        window by themselves, and no pole of the structure hangs on them.
        """
        old = self.right
        if old is None or old.shape[1] < 2:
            return None
        for _ in range(STEPS):
            u = _orthonormal(_apply(t, w, old))
            z = _apply(t.T, w, u)                 # the weights of both sides are the same
            small, s, v = decompose(z.T, z.shape[1])
            u = u @ small
            count = int(np.count_nonzero(s[:self.order] > (floor if w is not None
                                                           else floor * s[0])))
            lead = v[:, :max(2, count)]
            # a power step shrinks what the old subspace lacked by the ratio of squared values
            lacked = np.sqrt(((lead - old @ (old.T @ lead)) ** 2).sum(axis=0))
            if (lacked * (s[-1] / s[:lead.shape[1]]) ** 2).max() < LACK:
                return u, s, v
            if lacked.max() > FAR:
                return None
            old = v
        return None


def _apply(t, w, x):
    """Return W^-1 T W^-T x."""
    if w is None:
        return t @ x
    return dtrsm(1.0, w, t @ dtrsm(1.0, w, x, lower=1, trans_a=1), lower=1)


def _orthonormal(x):
    qr, tau, _, _ = dgeqrf(x)
    return dorgqr(qr, tau)[0]
