"""Rounding, clipping and losses that the samples show and the reference does not, (159)."""
import numpy as np
from scipy.special import bdtrc

from ssi_ros.effects.registry import detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.candidate import Form
from ssi_ros.gap.spectra.band_averages import spectra_of
from ssi_ros.hermitian import filtered
from ssi_ros.integrity.missing import lost_at_random
from ssi_ros.integrity.values import limit_of, step_of

MOST_TAKEN = 0.98       # of the power of a direction, that an effect may take away
SAME_STEP = 0.3         # |sin| of pi times values in steps: of multiples it is 0, of others 0.7
EXACT = 1e-300          # p-value of what is read off the samples and cannot be chance


@detects('dropped_samples', of='recordings')
def losses(effect, recordings):
    """Compare the shares of missing rows, (159)."""
    missing = recordings.pair.missing
    usual, share = (lost_at_random(m, np.inf) for m in missing)
    rows = len(missing[1])
    # so many or more of them by chance, binomial
    if share <= 1.5 * usual or bdtrc(round(share * rows) - 1, rows, max(usual, 1e-4)) > 1e-4:
        return None
    return Detection(effect.name, {'fraction': share}, EXACT,
                     f'{100 * share:.2g} % of the rows are missing, {100 * usual:.2g} % in the '
                     'reference', basis=lambda r: (Form({}, ()),))


@detects('quantisation', of='recordings')
def rounding(effect, recordings):
    """Compare the steps of the channels of two raw recordings."""
    one, two = recordings.raw
    coarse = []
    for a, b in zip(one.T, two.T):
        before, after = step_of(a), step_of(b)
        # steps far below the rms hardly change a record; of a loud reference they are too many
        away = np.abs(np.sin(np.pi * (a - np.nanmin(a)) / (after or np.inf)))
        if after > max(1.5 * before, 1e-4 * np.nanstd(b)) and np.nanmedian(away) > SAME_STEP:
            coarse.append(after)
    if not coarse or len(coarse) < one.shape[1] / 2:
        return None
    step = float(np.median(coarse))
    return Detection(
        effect.name, {'step_m_s2': step}, EXACT,
        f'all values are multiples of {step:.4g} m/s^2, in the reference they are not',
        basis=lambda r: (applied(r, lambda v: np.rint(v / step) * step),))


@detects('saturation', of='recordings')
def clipping(effect, recordings):
    """Compare the clipping limits of the channels of two raw recordings."""
    one, two = recordings.raw
    limits = {c: limit_of(b) for c, a, b in zip(recordings.pair.channels, one.T, two.T)
              if not limit_of(a)}
    limits = {c: v for c, v in limits.items() if v}
    if not limits:
        return None
    limit = min(limits.values())
    return Detection(
        effect.name, {'limit_m_s2': limit}, EXACT,
        f'{", ".join(limits)} repeat their extreme of {limit:.4g} m/s^2 exactly',
        basis=lambda r: (applied(r, lambda v: np.clip(v, -limit, limit)),))


def applied(recordings, change):
    """Return the form of an effect on samples: the reference with it, without a coordinate."""
    # It acts at the level of the record, where that differs by more than its uncertainty: of a
    # larger motion rounding is a smaller part.
    clean, scale = recordings.clean, np.exp(recordings.clear_level / 2)
    return replacing(recordings, change(clean.reference * scale) / scale)


def replacing(recordings, values):
    """Return the form of the reference with other values, shape (m, l), without a coordinate."""
    cut = recordings.nominal.cut
    added = filtered(recordings.turn, spectra_of(values, cut).mean
                     - spectra_of(recordings.clean.reference, cut).mean)

    def change(n, x):
        # some groups may hold less than the clipping takes from the mean
        lower = np.linalg.cholesky(n.spectrum)
        inverse = np.linalg.inv(lower)
        sizes, turn = np.linalg.eigh(inverse @ added @ inverse.conj().swapaxes(-1, -2))
        back = lower @ turn * np.sqrt(np.maximum(sizes, -MOST_TAKEN) + 1)[:, None, :]
        return None, back @ back.conj().swapaxes(-1, -2) - n.spectrum
    return Form({}, (), change)
