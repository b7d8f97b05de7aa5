"""
A line that the reference does not have, or a mode narrower than any bin, eq. (162) and (184).

Momentum in a wheel turns a free axis into a slow nutation without damping, whose amplitude and
phase vary with the forces on it. A sine has no skirts; such a mode has.
"""
import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import detects, showing
from ssi_ros.events.joint_lines import joint_line
from ssi_ros.events.lines import AROUND, flanks, OWN_BINS, resonances
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.stationary.samples import EXACT
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.scipy_later import maximum_filter1d, minimize_scalar, uniform_filter1d
from ssi_ros.tails import fisher, gamma

PEAK, FEW = 16.0, 12    # fewer bins than FEW within PEAK of the largest: no smooth level
OWN_SKIRT = 2           # bins of a line itself that are no skirts, on each side
SKIRT = 12              # bins in which its skirts are searched


@detects('harmonic_disturbance', of='recordings')
def line_or_mode(effect, recordings):
    """Detect a line; it is of a new mode if it has skirts."""
    pair = recordings.pair
    found = joint_line(recordings, line(recordings))
    if found is None:
        return None
    p, frequency, vector, faint = found
    text = f'a line at {frequency:.5g} Hz'
    if np.count_nonzero(vector) == 1 < len(vector):
        text += f' in channel {pair.channels[int(np.argmax(np.abs(vector)))]} alone'
    name, pattern = effect.name, ModalPattern.LINE
    if skirts(pair.reference, pair.record, frequency, pair.rate_hz) <= LIMITS.detected.value:
        pattern = ModalPattern.NEW_MODE
        name = showing(pattern)[0]
        text += (' with skirts, as of a mode that the reference does not have, or of a machine '
                 'whose speed varies')
    return line_detection(name, p, frequency, vector, text, pattern, faint)


def line_detection(name, p_value, frequency_hz, vector, text, pattern=ModalPattern.LINE,
                   weak=False):
    """Return the Detection of a line of complex amplitudes (l,)."""
    return Detection(
        name, {'frequency_hz': frequency_hz, 'acceleration_m_s2': float(np.linalg.norm(vector))},
        max(p_value, 10 * EXACT), text, weak=weak,
        basis=lambda r: (line_form(r, frequency_hz, vector, pattern),))


def line_form(recordings, frequency_hz, vector, pattern):
    """Return the form of a line: its power in the bands around it, of one shape (164)."""
    cut = recordings.nominal.cut
    bins = (cut.first + cut.band_bins * np.array(cut.chosen)[:, None] + np.arange(cut.band_bins))
    turn = np.exp(-2j * np.pi * np.arange(cut.rows) * frequency_hz / cut.rate_hz)
    weight = np.abs(np.fft.fft(cut.taper * turn.conj()))[bins] ** 2
    matrix = (weight.mean(axis=1) / 2)[:, None, None] * np.outer(vector, vector.conj())
    return Form({}, (Number('relative_power', '1', 1.0, 0.0, 100.0),),
                lambda n, x: (None, x[0] * matrix), pattern=pattern)


def line(recordings):
    """Search a line that the reference does not have, (162), or return None."""
    # p-value, frequency [Hz], amplitudes (l,), whether it is too small to be a gap by itself
    one, two, cut = recordings.pair.reference, recordings.pair.record, recordings.full_cut
    level = float(np.exp(recordings.level))
    found, before = _fine(two, cut), _fine(one, cut)
    f_two, f_one = (np.fft.rfftfreq(len(v), 1 / cut.rate_hz) for v in (two, one))
    usable = (f_two > cut.ends_hz[0]) & (f_two < cut.ends_hz[1])
    power = np.abs(found) ** 2
    f_two, power_here = f_two[usable], power[usable]
    bands = np.clip(np.searchsorted(cut.middles_hz + cut.width_hz / 2, f_two), 0, cut.bands - 1)
    scale = level * np.einsum('bii->bi', recordings.full_mean).real
    excess = (power_here / scale[bands]).mean(axis=1)
    fine = level * (np.abs(before) ** 2)
    reach = max(AROUND, int(np.ceil(AROUND * len(one) / len(two))))
    top = maximum_filter1d(fine, 2 * reach + 1, axis=0)
    at = np.clip(np.rint(f_two * len(one) / cut.rate_hz).astype(int), 0, len(f_one) - 1)
    excess = np.minimum(excess, (power_here / top[at]).mean(axis=1))
    # the channels may move as one
    width = two.shape[1]
    # a line stands alone, a narrow mode has flanks, which are lower where few bins hold all of it
    flat = power / resonances(np.fft.rfftfreq(len(two), 1 / cut.rate_hz), recordings)
    alone = (flat / flanks(flat, np.ones((len(flat), 1))))[usable].mean(axis=1)
    chance = np.maximum(gamma.sf(excess * width, width),
                        fisher.sf(alone, 2, 4 * (AROUND - OWN_BINS)))
    # of a peak of few bins, or of the lines of a periodic excitation, the level is a guess
    high = uniform_filter1d((fine > top / PEAK).astype(float), 2 * reach + 1, axis=0)
    rough = (high[at] * (2 * reach + 1) < FEW).any(axis=1)
    # there two recordings of one narrow mode differ as two exponential variables do
    chance[rough] = 1 / (1 + excess[rough])
    # of a sine of amplitude A under this taper the density is A^2 T / 3
    share = power_here * 1.5 * cut.rate_hz / len(two) / two.var(axis=0)
    faint = share.max(axis=1) < LIMITS.negligible_noise.value ** 2
    chance *= len(excess)
    loud = np.where(faint, 1.0, chance)
    best = int(np.argmin(loud if loud.min() < LIMITS.detected.value else chance))
    if not chance[best] < LIMITS.detected.value:
        return None
    vector = found[usable][best] * np.sqrt(3 * cut.rate_hz / len(two))
    return float(chance[best]), float(f_two[best]), vector, bool(faint[best])


def _fine(values, cut):
    taper = np.hanning(len(values) + 2)[1:-1]
    taper /= np.sqrt(np.sum(taper ** 2) * cut.rate_hz / 2)
    return np.fft.rfft(values * taper[:, None], axis=0)


def skirts(one, two, frequency_hz, rate_hz):
    """Return the chance that what is beside a line is the motion of the reference, (184)."""
    rows = min(len(one), len(two))
    one, two = one[:rows], two[:rows]
    taper = np.hanning(rows + 2)[1:-1][:, None]
    t = np.arange(rows) / rate_hz

    def without(f):
        wave = np.column_stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t)]) * taper
        return two * taper - wave @ np.linalg.lstsq(wave, two * taper, rcond=None)[0]
    step = rate_hz / rows
    best = minimize_scalar(lambda f: np.sum(without(f) ** 2), method='bounded',
                           bounds=(frequency_hz - step, frequency_hz + step))
    centre = int(np.rint(best.x / step))
    bins = centre + np.concatenate([np.arange(-SKIRT, -OWN_SKIRT),
                                    np.arange(OWN_SKIRT + 1, SKIRT + 1)])
    bins = bins[(bins > 0) & (bins <= rows // 2)]
    after, before = (np.abs(np.fft.rfft(v, axis=0)[bins]) ** 2
                     for v in (without(best.x), one * taper))
    # the channels may move as one, and a taper shares half of a bin with the next
    freedom = len(bins)
    ratio = np.median(after.sum(axis=0) / before.sum(axis=0))
    return float(fisher.sf(ratio, freedom, freedom))
