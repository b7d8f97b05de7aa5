"""What the operator may set; every default works untouched."""
from dataclasses import dataclass, fields

from ssi_ros.quantity import check, quantity

WEIGHTINGS = ('cva', 'upc')
METHODS = ('ssi_cov', 'ssi_data', 'era', 'okid')


@dataclass(frozen=True)
class Identification:
    """
    Settings of the identification on sliding windows.

    Raises
    ------
    ValueError
        For a value outside its declared range, and where two values contradict each other.

    """

    window_s: float = quantity(
        120.0, unit='s', low=0.1, high=86400.0, live=False,
        doc='length of the sliding window; a mode needs about 20 of its cycles in it')
    hop_s: float = quantity(
        1.0, unit='s', low=0.001, high=3600.0, live=False,
        doc='time between two results; the window is a whole number of hops')
    block_rows: int = quantity(
        0, low=0, high=400, live=False,
        doc='block rows i of the covariance matrix of every band; 0 chooses by the channels')
    order_max: int = quantity(
        60, low=2, high=400,
        doc='highest model order of every band')
    orders: int = quantity(
        8, low=3, high=100,
        doc='how many model orders vote on a mode')
    weighting: str = quantity(
        'cva', doc='cva (canonical variates) or upc (plain covariances)')
    bands: int = quantity(
        0, low=0, high=8, live=False,
        doc='how many bands, each a fifth of the rate of the one before; 0 chooses')
    decimation: int = quantity(
        1, low=1, high=100, live=False,
        doc='whole factor by which the rate is lowered first, behind a filter; 1 is none')
    damping_max: float = quantity(
        0.10, low=1e-4, high=0.9,
        doc='highest damping ratio of a mode')
    cycles_min: float = quantity(
        20.0, low=1.0, high=1e4,
        doc='cycles of a mode that the window must hold')

    def __post_init__(self):
        check(self)
        if self.weighting not in WEIGHTINGS:
            raise ValueError(f'weighting={self.weighting!r} is not known; known: '
                             + ', '.join(WEIGHTINGS))
        hops = self.window_s / self.hop_s
        if hops < 1.0 or abs(hops - round(hops)) > 1e-6 * hops:
            raise ValueError(f'window_s={self.window_s:g} must be a whole number of hops of '
                             f'hop_s={self.hop_s:g}; for example window_s='
                             f'{max(1, round(hops)) * self.hop_s:g}')

    @property
    def hops(self):
        """Return the number of hops in the window."""
        return round(self.window_s / self.hop_s)

    def changes(self, other):
        """Return the names of the quantities in which two settings differ."""
        return tuple(f.name for f in fields(self)
                     if getattr(self, f.name) != getattr(other, f.name))
