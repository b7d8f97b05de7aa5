"""
One way to call every package: record in, poles of all orders out.

A method is a pair of functions. The first does the work that is timed and returns what the package
returns; the second turns that into a list with one `Poles` an order. The packages are run as they
come, with their own defaults where a default exists.
"""
import contextlib
import io
from typing import NamedTuple
import warnings

import numpy as np

from ssi_ros.identify.lags import Ring
from ssi_ros.identify.realise import factorise, poles_of
from ssi_ros.identify.spread import block_spectra, spreads_of
from ssi_ros.identify.ssi_cov import ssi_cov

BLOCKS = 20             # data blocks of a spread, for all packages


class Poles(NamedTuple):
    """Poles of one order: frequency [Hz], damping ratio [1], shapes (p, l), spreads or None."""

    order: int
    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray
    frequency_std_hz: np.ndarray = None
    damping_ratio_std: np.ndarray = None


def of_lambda(order, lam, shapes, spreads=(None, None)):
    """Return the poles with positive imaginary part; lam (p,) [1/s], shapes (l, p)."""
    keep = np.asarray(lam).imag > 0.0
    lam, shapes = np.asarray(lam)[keep], np.asarray(shapes)[:, keep]
    spreads = [s if s is None else np.asarray(s)[keep] for s in spreads]
    return Poles(order, np.abs(lam) / (2.0 * np.pi), -lam.real / np.abs(lam), shapes.T, *spreads)


def quiet(run):
    """Run with what packages print thrown away."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()), \
            warnings.catch_warnings():
        warnings.simplefilter('ignore')
        return run()


def ours(weighting):
    """Return our core, as anybody calls it: record in, poles of every order out."""
    def run(values, rate_hz, rows, orders):
        return ssi_cov(values, rate_hz, rows, orders, weighting)
    return run, lambda raw: [Poles(p.order, p.frequency_hz, p.damping_ratio, p.shapes)
                             for p in raw]


def ours_spreads(values, rate_hz, rows, orders):
    """Return the poles of every order with the spreads of frequency, damping and shape."""
    hop = len(values) // BLOCKS
    ring = Ring(BLOCKS, 2 * rows - 1, values.shape[1])
    for k in range(BLOCKS):
        ring.push(values[k * hop:(k + 1) * hop])
    covariances = ring.covariances(hop / rate_hz)
    factors = factorise(covariances, rows, max(orders), 'cva')
    spectra = block_spectra(covariances, rows)
    every = poles_of(factors, orders, rate_hz, covariances.scale)
    return [(p, spreads_of(factors, p, np.arange(len(p.mu)), rows, spectra, rate_hz,
                           covariances.scale)) for p in every if len(p.mu)]


def read_ours_spreads(raw):
    """Turn our poles and spreads into the common form."""
    return [Poles(p.order, p.frequency_hz, p.damping_ratio, p.shapes, s.frequency_hz,
                  s.damping_ratio) for p, s in raw]


def pyoma2(kind):
    """Return pyOMA2's functions, without criteria and labels."""
    def run(values, rate_hz, rows, orders):
        from pyoma2.functions import ssi
        step = _step(orders)
        hankel, _ = ssi.build_hank(values.T, values.T, rows, kind)
        observability, a, c, _ = ssi.SSI_fast(hankel, rows, max(orders), step)
        return step, ssi.SSI_poles(observability, a, c, max(orders), 1.0 / rate_hz, step, HC=False)
    return run, read_pyoma2


def _step(orders):
    """Return pyOMA2's step: it counts from 0, so one order alone is its own step."""
    return orders[1] - orders[0] if len(orders) > 1 else orders[0]


def read_pyoma2(raw):
    """Turn pyOMA2's tables, one column an order, into poles."""
    step, (_, _, shapes, lam, f_std, x_std, _) = raw
    every = []
    for k in range(1, lam.shape[1]):
        keep = np.isfinite(lam[:, k])
        spreads = (None, None) if f_std is None else (f_std[keep, k], x_std[keep, k])
        every.append(of_lambda(k * step, lam[keep, k], shapes[keep, k].T, spreads))
    return every


def pyoma2_class(values, rate_hz, rows, orders):
    """Return what a user of pyOMA2 calls: the class, with its criteria and labels."""
    from pyoma2.algorithms import SSI
    from pyoma2.setup import SingleSetup
    setup = SingleSetup(values, fs=rate_hz)
    step = _step(orders)
    method = SSI(name='ssi', method='cov', br=rows, ordmax=max(orders), step=step)
    setup.add_algorithms(method)
    setup.run_by_name('ssi')
    r = method.result
    return step, (r.Fn_poles, r.Xi_poles, r.Phi_poles, r.Lambds, None, None, None)


def pyoma2_spreads(values, rate_hz, rows, orders):
    """Return pyOMA2 with uncertainty; every order, as its spreads are wrong for a step of 2."""
    from pyoma2.functions import ssi
    step = _step(orders)
    hankel, t = ssi.build_hank(values.T, values.T, rows, 'cov', True, BLOCKS)
    observability, a, c, _ = ssi.SSI_fast(hankel, rows, max(orders), step)
    return step, ssi.SSI_poles(observability, a, c, max(orders), 1.0 / rate_hz, step, HC=True,
                               calc_unc=True, H=hankel, T=t)


def koma(weighting):
    """Return koma's `covssi` with its default, the Hankel matrix."""
    def run(values, rate_hz, rows, orders):
        from koma.oma import covssi
        # its words are compared by identity, so they must be literals
        return orders, covssi(values, rate_hz, rows, list(orders), showinfo=False,
                              return_flat=False,
                              weighting='cva' if weighting == 'cva' else 'none')
    return run, lambda raw: [_halves(n, lam, phi) for n, lam, phi in zip(raw[0], *raw[1])]


def _halves(order, lam, phi):
    """Turn koma's poles, one of each pair of either sign, into those above the real axis."""
    below = lam.imag < 0.0
    return of_lambda(order, np.where(below, lam.conj(), lam), np.where(below, phi.conj(), phi))


def strid(values, rate_hz, rows, orders):
    """Return strid's covariance-driven class, asked for one order after the other."""
    import strid as package
    method = package.CovarianceDrivenStochasticSID(values.T, rate_hz)
    try:
        found = []
        for n in orders:
            a, c, _, _ = method.perform(n, rows)
            found.append((n, package.Mode.find_modes_from_ss(a, c, rate_hz)))
        return found
    finally:        # its caches would keep the data matrix of every record
        for name in ('_Y', '_R', '_T', '_svd_block_toeplitz'):
            getattr(type(method), name).cache_clear()


def read_strid(raw):
    """Turn strid's modes into poles."""
    return [of_lambda(n, [m.eigenvalue for m in modes], np.array([m.v for m in modes]).T)
            if modes else Poles(n, np.empty(0), np.empty(0), np.empty((0, 4)))
            for n, modes in raw]


def toolbox(values, rate_hz, rows, orders):
    """Return the pyOMA toolbox, Weimar: covariances, all orders up to the highest."""
    from pyOMA.core.PreProcessingTools import PreProcessSignals
    from pyOMA.core.SSICovRef import BRSSICovRef
    signals = PreProcessSignals(values, rate_hz)
    signals.corr_blackman_tukey(2 * rows, refs_only=True)
    method = BRSSICovRef(signals)
    method.build_toeplitz_cov(rows, rows - 1)
    method.compute_modal_params(max(orders) + 1, algo='qr', modal_contrib=False)
    return rate_hz, method, orders


def toolbox_spreads(values, rate_hz, rows, orders):
    """Return the pyOMA toolbox, Weimar, with its spreads by the fast algorithm."""
    from pyOMA.core.PreProcessingTools import PreProcessSignals
    from pyOMA.core.VarSSIRef import VarSSIRef
    signals = PreProcessSignals(values, rate_hz)
    signals.corr_blackman_tukey(2 * rows, BLOCKS, refs_only=True)
    method = VarSSIRef(signals)
    method.build_subspace_mat(rows, rows - 1, BLOCKS)
    method.compute_state_matrices(max(orders) + 1, lsq_method='pinv')
    method.prepare_sensitivities('fast')
    method.compute_modal_params()
    return rate_hz, method, orders


def read_toolbox(raw):
    """Turn the toolbox's tables, damping in percent, into poles."""
    rate_hz, method, orders = raw
    every = []
    for n in orders:
        keep = method.modal_frequencies[n] > 0.0
        spreads = [None, None]
        if hasattr(method, 'std_frequencies'):
            spreads = [method.std_frequencies[n][keep], method.std_damping[n][keep] / 100.0]
        every.append(Poles(n, method.modal_frequencies[n][keep],
                           method.modal_damping[n][keep] / 100.0,
                           method.mode_shapes[:, :len(keep), n].T[keep], *spreads))
    return every


CORES = {
    'ours, CVA': ours('cva'),
    'ours, UPC': ours('upc'),
    'koma 1.3.6 hankel': koma('none'),
    'pyOMA2 1.4.3 cov': pyoma2('cov'),
    'pyOMA2 1.4.3 cov_R': pyoma2('cov_R'),
    'strid 0.4.3': (strid, read_strid),
    'pyOMA toolbox 1.1.0': (toolbox, read_toolbox),
}
CLASSES = {'pyOMA2 1.4.3 class SSI': (pyoma2_class, read_pyoma2)}
# strid and the toolbox estimate the same as pyOMA2's cov and cov_R
ACCURATE = {**{k: v for k, v in CORES.items() if 'strid' not in k and 'toolbox' not in k},
            'koma 1.3.6 cva': koma('cva'), 'pyOMA2 1.4.3 dat': pyoma2('dat')}
SPREADS = {'ours, CVA': (ours_spreads, read_ours_spreads),
           'pyOMA2 1.4.3, step 1': (pyoma2_spreads, read_pyoma2),
           'pyOMA toolbox 1.1.0': (toolbox_spreads, read_toolbox)}
