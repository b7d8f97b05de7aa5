"""Whether the power that a record has beyond its reference repeats itself with its drive."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.spectra.band_averages import silent, spectra_of


@dataclass(frozen=True)
class Excess:
    """Power of a record beyond what the level of the reference explains."""

    share: float = 0.0      # of the power of the record, in the least of the two loudest channels
    repeated: float = 0.0   # share of it that is the same in every period
    outside: float = 0.0    # share of it in bands that hold none of the drive


def excess_of(repeats, usual, cut):
    """
    Return the Excess of a record.

    `repeats` is of the reference and of the record, `usual` (b, l, l) the spectrum of the
    reference at the level of the record in the bands of `cut`.
    """
    width = usual.shape[1]
    count = len(repeats[1].periods)
    tiled = np.tile(repeats[1].mean, (count, 1))
    whole = repeats[1].periods.reshape(-1, width)
    there, same, before = (np.einsum('bii->bi', spectra_of(v, cut).mean).real for v in (
        whole, tiled, np.tile(repeats[0].mean, (len(repeats[0].periods), 1))))
    beyond = np.maximum(there - 2 * np.einsum('bii->bi', usual).real, 0.0)
    total = beyond.sum(axis=0)
    idle = np.all([silent(p) for p in before.T], axis=0)
    shares = np.sort(total / there.sum(axis=0))
    again = np.minimum(same / np.maximum(there, 1e-300), 1.0)
    scaled = beyond / np.maximum(there.sum(axis=0), 1e-300)
    amount = max(scaled.sum(), 1e-300)
    return Excess(float(shares[-2] if width > 1 else 0.0), float((scaled * again).sum() / amount),
                  float(scaled[idle].sum() / amount))
