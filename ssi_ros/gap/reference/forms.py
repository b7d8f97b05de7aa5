"""
Modal forms of effects: what each does to the spectrum of a reference, eq. (145) to (149).

Without geometry an effect is a filter of the channels and a spectrum added to them,

    S' = a [G (S - N) G^H + N + A] + nu N,

with N the noise floor of the channels; null at x = 0. A sensor's noise comes after it, so that no
effect filters N; a recorder that works on samples filters N like all else. A variant each. One
function an effect yields its forms, one for each place where it can act.
"""
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ssi_ros.gap.reference.nominal import reach_hz

POINTS = 17             # at which a resonance is averaged over a band
WIDER = 1.5             # times its way, the distance from a mode at which its move still counts
LEAST_CHANNELS = 3      # to tell one that moved from a structure that did
LAGS = (0.3, 3.0)       # time constants of slow noise that a fit starts from, in 1 / lowest f


@dataclass(frozen=True)
class Number:
    """
    A coordinate x that a fit moves.

    `start` is where it begins (a size that is small but not null), `low` and `high` its range,
    `value(x)` what the user reads.
    """

    name: str
    unit: str
    start: float
    low: float
    high: float
    value: Callable = float


@dataclass(frozen=True, eq=False)
class Form:
    """
    One effect at one place.

    Attributes
    ----------
    effect : str
        Name in the library.
    place : dict
        Such as {'channel': 'a'}.
    numbers : tuple of Number
        Coordinates.
    change : callable
        change(nominal, x) -> (gain, added), each of shape (b, l, l) or None.
    meaning : str
        What it says of the structure, in words.
    also : tuple of str
        Effects of the library that have this same form without geometry.
    places : int
        Among how many this one was chosen.
    levels : ndarray, shape (g,), optional
        Power of each group of the record over its mean, for a level that wanders.
    crossed : ndarray of bool, shape (g, b), optional
        Cells of the record that hold what comes and goes, and are left out with it.
    constants : dict
        Numbers that were read off the samples, {name: (value, unit)}.
    begin : ndarray, shape (p,), optional
        Coordinates at which a fit begins, if they are known better than the numbers' starts.
    whole : bool
        Whether filters act on the noise of the channels as well: on samples, not on sensors.
    variants : tuple of Form
        The same effect at the same place, of another make.
    measured : float
        How many numbers were taken from the record itself, at half a nat each.
    odds : float
        Log odds that speak for the effect where no spectrum does.

    """

    effect: str
    place: dict
    numbers: tuple
    change: Callable
    meaning: str = ''
    also: tuple = ()
    places: int = 1
    levels: np.ndarray = None
    crossed: np.ndarray = None
    constants: dict = field(default_factory=dict)
    begin: np.ndarray = None
    whole: bool = False
    variants: tuple = ()
    measured: float = 0.0
    odds: float = 0.0

    @property
    def start(self):
        """Return the coordinates at which a fit begins."""
        return [n.start for n in self.numbers] if self.begin is None else list(self.begin)

    @property
    def kind(self):
        """Return what two forms have in common that differ by their numbers' values alone."""
        return self.effect, tuple(self.place.items()), tuple(n.name for n in self.numbers)


def _units(nominal):
    return nominal.cut.middles_hz / (nominal.cut.rate_hz / 2)


def _diagonal(nominal, channel, factor):
    """Return a filter of one channel, or of all, as matrices (b, l, l)."""
    width, bands = len(nominal.channels), nominal.cut.bands
    gains = np.ones((bands, width), complex)
    which = slice(None) if channel is None else slice(channel, channel + 1)
    gains[:, which] = np.reshape(factor, (bands, 1))
    return gains[:, :, None] * np.eye(width)


def _on_channel(nominal, channel, power):
    added = np.zeros((nominal.cut.bands, *(len(nominal.channels),) * 2))
    added[:, channel, channel] = power
    return added


def excitation_colour(nominal):
    """Yield a first-order corner, eq. (145), and a smooth colour of any shape."""
    def corner(n, x):
        power = (1 + max(-x[0], 0.0) * _units(n) ** 2) / (1 + max(x[0], 0.0) * _units(n) ** 2)
        return _diagonal(n, None, np.sqrt(power)), None

    def smooth(n, x):
        u = np.log(n.cut.middles_hz)
        u = 2 * (u - u[0]) / (u[-1] - u[0]) - 1
        power = sum(c * np.polynomial.legendre.Legendre.basis(k + 1)(u) for k, c in enumerate(x))
        return _diagonal(n, None, np.exp(np.clip(power, -20, 20) / 2)), None
    half = nominal.cut.rate_hz / 2
    yield Form('excitation_colour', {}, (
        Number('corner_hz', 'Hz', 0.1, -1e4, 1e4, lambda x: half / np.sqrt(max(abs(x), 1e-12))),),
        corner, 'the excitation of one recording has a corner that the other has not',
        ('sensor_bandwidth',))
    yield Form('excitation_colour', {}, tuple(
        Number(f'log_power_{k}', '1', 0.02, -20, 20) for k in (1, 2, 3)), smooth,
        'the excitation has another colour: power as a polynomial of log f',
        ('sensor_bandwidth',))


def sensor_gain(nominal):
    """Yield a factor of each channel; with one channel it is the level."""
    for c, name in enumerate(nominal.channels):
        if len(nominal.channels) > 1:
            yield Form('sensor_gain', {'channel': name}, (
                Number('scale', '1', 0.01, -0.99, 20, lambda x: 1 + x),),
                lambda n, x, c=c: (_diagonal(n, c, np.full(n.cut.bands, 1 + x[0])), None))


def sensor_crosstalk(nominal):
    """Yield a share of each channel in each other."""
    for c, name in enumerate(nominal.channels):
        for s, source in enumerate(nominal.channels):
            def change(n, x, c=c, s=s):
                gain = np.tile(np.eye(len(n.channels)), (n.cut.bands, 1, 1))
                gain[:, c, s] = x[0]
                return gain, None
            if s != c:
                yield Form('sensor_crosstalk', {'source': source, 'channel': name},
                           (Number('gain', '1', 0.01, -5, 5),), change)


def channel_delay(nominal):
    """Yield a delay of each channel against the others, eq. (146)."""
    rate = nominal.cut.rate_hz
    for c, name in enumerate(nominal.channels):
        if len(nominal.channels) > 1:
            yield Form('channel_delay', {'channel': name}, (
                Number('delay_s', 's', 0.02, -50, 50, lambda x: x / rate),),
                lambda n, x, c=c: (_diagonal(n, c, np.exp(-1j * np.pi * _units(n) * x[0])), None))


def sensor_bandwidth(nominal):
    """Yield a Butterworth low-pass of second order of all channels, and of each."""
    half = nominal.cut.rate_hz / 2
    places = [None] + list(range(len(nominal.channels))) * (len(nominal.channels) > 1)
    for c in places:
        def change(n, x, c=c):
            w = _units(n) * abs(x[0])
            response = 1 / (1 - w ** 2 + 1j * np.sqrt(2) * w)
            return _diagonal(n, c, response if x[0] > 0 else 1 / response), None

        def digital(n, x, c=c):
            # the same filter on samples: its frequencies are those of the bilinear transform
            corner = np.tan(np.pi / 2 / (1 + abs(x[0])))
            w = np.tan(np.pi / 2 * _units(n)) / corner
            response = 1 / (1 - w ** 2 + 1j * np.sqrt(2) * w)
            return _diagonal(n, c, response if x[0] > 0 else 1 / response), None
        form = Form('sensor_bandwidth', {'channel': 'all' if c is None else nominal.channels[c]}, (
            Number('corner_hz', 'Hz', 0.4, -50, 50, lambda x: half / max(abs(x), 1e-9)),), change,
            'a low-pass that one recording has and the other has not',
            ('excitation_colour',) if c is None else ())
        number = replace(form.numbers[0], value=lambda x: half / (1 + abs(x)))
        yield replace(form, variants=(
            replace(form, whole=True),
            replace(form, numbers=(number,), change=digital),
            replace(form, numbers=(number,), change=digital, whole=True)))


def sensor_noise(nominal):
    """Yield white noise of each channel, over the floor of the reference."""
    for c, name in enumerate(nominal.channels):
        yield Form('sensor_noise', {'channel': name}, (
            Number('scale', '1', 0.1, -0.9, 1e8, lambda x: np.sqrt(1 + x)),),
            lambda n, x, c=c: (None, _on_channel(n, c, x[0] * n.floor[c])),
            'white noise over the floor of the reference, which is an upper bound of its noise')


def sensor_drift(nominal):
    """Yield slow noise of each channel, eq. (88)."""
    low = nominal.cut.ends_hz[0]
    for c, name in enumerate(nominal.channels):
        for start in LAGS:
            tau = start / (2 * np.pi * low)

            def change(n, x, c=c, tau=tau):
                f = n.cut.middles_hz
                shape = (1 + (2 * np.pi * tau * n.cut.ends_hz[0]) ** 2) / (
                    1 + (2 * np.pi * tau * f) ** 2)
                return None, _on_channel(n, c, x[0] * n.spectrum[0, c, c].real * shape)
            rms = np.sqrt(nominal.spectrum[0, c, c].real
                          * (1 + (2 * np.pi * tau * low) ** 2) / (4 * tau))
            number = Number('rms_m_s2', 'm/s^2', 0.1, -0.5, 1e10,
                            lambda x, rms=rms: rms * np.sqrt(max(x, 0.0)))
            yield Form('sensor_drift', {'channel': name}, (number,), change,
                       f'slow noise of a time constant of about {tau:.2g} s')


def timestamp_jitter(nominal):
    """Yield wandering sampling instants: high frequencies fade into white noise, eq. (148)."""
    rate = nominal.cut.rate_hz

    def change(n, x):
        w2 = (np.pi * _units(n)) ** 2           # (omega / rate)^2
        lost = -np.expm1(np.clip(-w2 * x[0], -20, 20))      # goes into white noise
        noise = (lost[:, None, None] * n.spectrum).mean(axis=0)
        return _diagonal(n, None, np.sqrt(1 - lost)), np.tile(noise, (n.cut.bands, 1, 1))
    yield Form('timestamp_jitter', {}, (
        Number('rms_s', 's', 1e-3, -0.5, 400.0, lambda x: np.sqrt(max(x, 0.0)) / rate),), change,
        whole=True)


def modal_gain(nominal, ratios, damping_ratios):
    """
    Return the filter that moves modes: frequencies times ratios, damping times others, eq. (147).

    Parameters
    ----------
    nominal : Nominal
        With its modes.
    ratios, damping_ratios : ndarray, shape (m,)
        New over old.

    Returns
    -------
    ndarray, shape (b, l, l)

    """
    modes, cut = nominal.modes, nominal.cut
    width = len(nominal.channels)
    gain = np.tile(np.eye(width, dtype=complex), (cut.bands, 1, 1))
    half = (cut.band_bins / 2 + 1) * cut.resolution_hz
    for i in range(len(modes)):
        if ratios[i] == 1.0 and damping_ratios[i] == 1.0:
            continue
        f0, xi = modes.frequencies_hz[i], modes.damping_ratios[i]
        reach = max(reach_hz(f0, xi, cut), WIDER * abs(ratios[i] - 1) * f0)
        near = np.flatnonzero(np.abs(cut.middles_hz - f0) < 3 * reach)
        f = cut.middles_hz[near][:, None] + np.linspace(-half, half, POINTS)
        power = _resonance(f, f0 * ratios[i], xi * damping_ratios[i]).mean(axis=1) / (
            _resonance(f, f0, xi).mean(axis=1))
        # far away other modes have the word
        window = 1 / (1 + ((cut.middles_hz[near] - f0) / reach) ** 8)
        factor = np.exp(window * np.log(power) / 2) - 1
        pick = np.outer(modes.shapes[:, i], modes.duals[:, i].conj())
        gain[near] = (np.eye(width) + factor[:, None, None] * pick) @ gain[near]
    return gain


def _resonance(f, f0, xi):
    """Return the power of the acceleration of a mode under a white force of fixed level."""
    return f ** 4 / ((f0 ** 2 - f ** 2) ** 2 + (2 * xi * f0 * f) ** 2)


def at_mode(frequency_hz):
    """Return the end of a parameter's name that tells the mode, free of dots."""
    return f'at_{1000 * frequency_hz:.0f}_mhz'


GEOMETRIC = ('array_asymmetry', 'added_mass', 'hinge_compliance', 'hub_inertia', 'fuel_slosh',
             'gyroscopic_coupling', 'hinge_freeplay', 'hinge_friction', 'cubic_stiffness')


def stiffness_scale(nominal):
    """Yield all modes moved alike, and each on its own."""
    modes = nominal.modes
    if not len(modes):
        return

    def common(n, x):
        return modal_gain(n, np.full(len(n.modes), np.exp(x[0] / 2)), np.ones(len(n.modes))), None

    def each(n, x):
        return modal_gain(n, np.exp(np.array(x) / 2), np.ones(len(n.modes))), None
    number = ('1', 0.002, -1.0, 1.0, np.exp)
    yield Form('stiffness_scale', {}, (Number('scale', *number),), common,
               'all frequencies changed by one factor', ('clock_rate',))
    if len(modes) > 1:
        yield Form('stiffness_scale', {'modes': 'each'}, tuple(
            Number(f'scale_{at_mode(f)}', *number) for f in modes.frequencies_hz), each,
            'some modes changed, not all alike', GEOMETRIC)


def damping_scale(nominal):
    """Yield the damping of all modes changed alike, and of each on its own."""
    modes = nominal.modes
    if not len(modes):
        return

    def common(n, x):
        return modal_gain(n, np.ones(len(n.modes)), np.full(len(n.modes), np.exp(x[0]))), None

    def each(n, x):
        return modal_gain(n, np.ones(len(n.modes)), np.exp(np.array(x))), None
    number = ('1', 0.1, -4.0, 4.0, np.exp)
    yield Form('damping_scale', {}, (Number('scale', *number),), common)
    if len(modes) > 1:
        yield Form('damping_scale', {'modes': 'each'}, tuple(
            Number(f'scale_{at_mode(f)}', *number) for f in modes.frequencies_hz), each,
            'some modes are damped otherwise', ('attitude_controller', 'fuel_slosh'))


def sensor_misplacement(nominal):
    """
    Yield the components of all modes at one channel, each changed on its own, eq. (180).

    Of two channels nobody could say which moved, or whether the structure did.
    """
    modes, width = nominal.modes, len(nominal.channels)
    if not len(modes) or width < LEAST_CHANNELS:
        return
    picks = mode_picks(nominal)
    for c, name in enumerate(nominal.channels):
        def change(n, x, c=c):
            gain = np.tile(np.eye(width, dtype=complex), (n.cut.bands, 1, 1))
            gain[:, c] += np.tensordot(x, picks, 1)
            return gain, None
        yield Form('sensor_misplacement', {'channel': name}, tuple(
            Number(f'component_{at_mode(f)}', '1', 0.01, -3.0, 3.0)
            for f in modes.frequencies_hz), change,
            'one channel sees every mode otherwise, and the others do not')


def mode_picks(nominal):
    """
    Return the rows that pick each mode out of the channels where it has the word, (m, b, l).

    It has it up to half-way to the next; those within reach are told apart by their shapes.
    """
    modes, cut = nominal.modes, nominal.cut
    found = []
    for i, (f, xi) in enumerate(zip(modes.frequencies_hz, modes.damping_ratios)):
        others = modes.frequencies_hz[np.abs(modes.frequencies_hz - f) > reach_hz(f, xi, cut)]
        halves = [np.abs(o - f).min(initial=np.inf) / 2 for o in (others[others < f],
                                                                  others[others > f])]
        away = cut.middles_hz - f
        share = 1 / (1 + (away / np.where(away < 0, *halves)) ** 8)
        found.append(share[:, None] * modes.duals[:, i].conj())
    return np.array(found)


FORMS = (excitation_colour, sensor_gain, sensor_crosstalk, sensor_misplacement, channel_delay,
         sensor_bandwidth, sensor_noise, sensor_drift, timestamp_jitter, stiffness_scale,
         damping_scale)


def all_forms(nominal, names=None):
    """Return every form of the effects called `names` (all if None) for a nominal."""
    forms = [f for function in FORMS for f in function(nominal)]
    like = [(f.effect, len(f.numbers)) for f in forms]
    forms = [replace(f, places=like.count(kind)) for f, kind in zip(forms, like)]
    return tuple(f for f in forms
                 if names is None or f.effect in names or set(f.also) & set(names))
