"""Forms that need the data: a sign applied to the reference, a line, a drift, a nonlinearity."""
import numpy as np
from scipy.ndimage import uniform_filter1d

from ssi_ros.gap.reference.forms import at_mode, Form, modal_gain, Number
from ssi_ros.gap.reference.nutation import NEW_MODES
from ssi_ros.gap.reference.pieces import spectra_of

DRIFT_STEPS = 9
MOST_TAKEN = 0.98       # of what a direction holds
NEIGHBOURS = 15         # bands over which the distortion of a nonlinearity is smoothed
ABOVE = 4.0             # times the reference, beyond which a band holds mostly distortion
NONLINEAR = ('hinge_friction', 'hinge_freeplay', 'cubic_stiffness')


def has_each_mode(form, count):
    """Return whether a form has numbers of its own for each of `count` modes."""
    return count > 1 and len(form.numbers) in (count, 2 * count) and form.effect in (
        'stiffness_scale', 'damping_scale', *NONLINEAR) and form.place.get('modes') != 'mixed'


def of_sign(sign, pair, cut, levels, level=0.0):
    """
    Return the form of a sign: the reference with the effect in its samples, without a number.

    Parameters
    ----------
    sign : Sign
        What was seen.
    pair : Pair
        The recordings, without dither.
    cut : Cut
        Bands.
    levels : ndarray, shape (g,)
        Power of each group of the record over its mean.
    level : float
        Logarithm of the power of the record over that of the reference; 0 where it is not sure,
        for rounding a little louder a motion rounds it otherwise.

    Returns
    -------
    Form

    """
    level = np.exp(level / 2)
    values = pair.reference * level
    if sign.effect == 'quantisation':
        step = sign.numbers['step_m_s2'][0]
        values = np.rint(values / step) * step
    elif sign.effect == 'saturation':
        limit = sign.numbers['limit_m_s2'][0]
        values = np.clip(values, -limit, limit)
    else:
        wanders = sign.effect == 'nonstationary_excitation'
        return Form(sign.effect, sign.place, (), lambda n, x: (None, None), sign.text,
                    levels=levels if wanders else None, constants=sign.numbers)
    return replacing(sign, pair, values / level, cut)


def replacing(sign, pair, values, cut):
    """Return the form of a sign as the reference with other values, shape (m, l)."""
    added = spectra_of(values, cut).mean - spectra_of(pair.reference, cut).mean

    def change(n, x):
        # some groups may hold less than the clipping takes from the mean
        lower = np.linalg.cholesky(n.spectrum)
        inverse = np.linalg.inv(lower)
        sizes, turn = np.linalg.eigh(inverse @ added @ inverse.conj().swapaxes(-1, -2))
        back = lower @ turn * np.sqrt(np.maximum(sizes, -MOST_TAKEN) + 1)[:, None, :]
        return None, back @ back.conj().swapaxes(-1, -2) - n.spectrum
    return Form(sign.effect, sign.place, (), change, sign.text, constants=sign.numbers)


def of_line(sign, cut, channels):
    """Return the form of a line: its power in the bands around it, of one shape (164)."""
    frequency = sign.numbers['frequency_hz'][0]
    bins = (cut.first + cut.band_bins * np.array(cut.chosen)[:, None]
            + np.arange(cut.band_bins))
    turn = np.exp(-2j * np.pi * np.arange(cut.rows) * frequency / cut.rate_hz)
    weight = np.abs(np.fft.fft(cut.taper * turn.conj()))[bins] ** 2
    shape = weight.mean(axis=1) / 2
    vector = np.array(sign.place['shape'])
    matrix = shape[:, None, None] * np.outer(vector, vector.conj())
    also = NEW_MODES[1:] if sign.effect in NEW_MODES else ('wheel_speed_sweep',)
    return Form(sign.effect, {}, (Number('relative_power', '1', 1.0, 0.0, 100.0),),
                lambda n, x: (None, x[0] * matrix), sign.text, also, constants=sign.numbers)


def stiffness_drift(nominal):
    """Return the form of frequencies that move through the record, eq. (163), or None."""
    if not len(nominal.modes):
        return None
    steps = (np.arange(DRIFT_STEPS) + 0.5) / DRIFT_STEPS

    def change(n, x):
        ones = np.ones(len(n.modes))
        return np.array([modal_gain(n, np.sqrt(1 + x[0] * u) * ones, ones) for u in steps]), None
    return Form('stiffness_drift', {}, (Number('change', '1', 0.01, -0.5, 0.5),), change,
                'frequencies move through the record')


def distortion_of(nominal, base, seen):
    """
    Return the power that the record has beyond the level, smooth over bands, eq. (157).

    Only bands count where it outweighs what the level explains: a resonance that moved is not
    distortion.

    Returns
    -------
    added : ndarray, shape (b, l, l)
        At the level of the reference.
    share : ndarray, shape (l,)
        Power of it over the power of the record, a channel.

    """
    there = np.einsum('bii->bi', seen).real
    usual = np.einsum('bii->bi', base.prediction.mean).real
    ratio = uniform_filter1d(there, NEIGHBOURS, axis=0) / uniform_filter1d(usual, NEIGHBOURS, 0)
    mostly = np.median(ratio, axis=1) > ABOVE
    added = positive(np.where(mostly[:, None, None], seen - base.prediction.mean, 0.0))
    share = np.einsum('bii->i', added).real / there.sum(axis=0)
    return added / np.exp(base.x[0]), share


def excess(base, seen):
    """Return what a record has beyond the level, at that of the reference, (b, l, l)."""
    return positive(seen - base.prediction.mean) / np.exp(base.x[0])


def positive(difference):
    """Return what of a difference, smooth over three bands, is a spectrum, (b, l, l)."""
    smooth = uniform_filter1d(difference.real, 3, 0) + 1j * uniform_filter1d(
        difference.imag, 3, 0)
    values, vectors = np.linalg.eigh(smooth)
    return (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.conj().swapaxes(-1, -2)


def nonlinearity(nominal, effect, added, meaning, also):
    """
    Return the equivalent linear form of an amplitude-dependent joint, eq. (157).

    Every mode takes the frequency and the damping of the other amplitude; the distortion is
    beside them.
    """
    modes, count = nominal.modes, len(nominal.modes)

    def change(n, x):
        return modal_gain(n, np.exp(x[:count] / 2), np.exp(x[count:2 * count])), added
    numbers = tuple(Number(f'stiffness_{at_mode(f)}', '1', 0.002, -1.0, 1.0, np.exp)
                    for f in modes.frequencies_hz)
    numbers += tuple(Number(f'damping_{at_mode(f)}', '1', 0.1, -3.0, 3.0, np.exp)
                     for f in modes.frequencies_hz)
    return Form(effect, {}, numbers, change, meaning, also)
