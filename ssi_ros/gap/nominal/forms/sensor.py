"""Modal forms of sensors and of their sampling, eq. (146) and (148); each is null at x = 0."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.effects.registry import modal_form
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.modal.reference import reach_hz

LEAST_CHANNELS = 3      # that distinguish one that moved from a structure that changed
LAGS = (0.3, 3.0)       # time constants of slow noise that a fit starts from, in 1 / lowest f


def nyquist_share(nominal):
    """Return the frequencies of the bands over half of the rate, shape (b,)."""
    return nominal.cut.middles_hz / (nominal.cut.rate_hz / 2)


def filter_of(nominal, channel, factor):
    """Return a filter of one channel, or of all, as matrices (b, l, l)."""
    width, bands = len(nominal.channels), nominal.cut.bands
    gains = np.ones((bands, width), complex)
    which = slice(None) if channel is None else slice(channel, channel + 1)
    gains[:, which] = np.reshape(factor, (bands, 1))
    return gains[:, :, None] * np.eye(width)


def _noise_of(nominal, channel, power):
    added = np.zeros((nominal.cut.bands, *(len(nominal.channels),) * 2))
    added[:, channel, channel] = power
    return added


@modal_form('sensor_gain')
def gain(nominal):
    """Yield a factor of each channel; with one channel it is the level."""
    for c, name in enumerate(nominal.channels):
        if len(nominal.channels) > 1:
            form = Form({'channel': name}, (
                Number('scale', '1', 0.01, -0.99, 20, lambda x: 1 + x),),
                lambda n, x, c=c: (filter_of(n, c, np.full(n.cut.bands, 1 + x[0])), None))
            yield replace(form, variants=(replace(form, on_samples=True),))


@modal_form('sensor_crosstalk')
def crosstalk(nominal):
    """Yield a share of each channel in each other."""
    for c, name in enumerate(nominal.channels):
        for s, source in enumerate(nominal.channels):
            def change(n, x, c=c, s=s):
                gains = np.tile(np.eye(len(n.channels)), (n.cut.bands, 1, 1))
                gains[:, c, s] = x[0]
                return gains, None
            if s != c:
                yield Form({'source': source, 'channel': name},
                           (Number('gain', '1', 0.01, -5, 5),), change)


@modal_form('channel_delay')
def delay(nominal):
    """Yield a delay of each channel against the others, eq. (146)."""
    rate = nominal.cut.rate_hz
    for c, name in enumerate(nominal.channels):
        if len(nominal.channels) > 1:
            yield Form({'channel': name}, (
                Number('delay_s', 's', 0.02, -50, 50, lambda x: x / rate),),
                lambda n, x, c=c: (
                    filter_of(n, c, np.exp(-1j * np.pi * nyquist_share(n) * x[0])), None))


@modal_form('sensor_bandwidth')
def bandwidth(nominal):
    """Yield a Butterworth low-pass of second order of all channels, and of each."""
    half = nominal.cut.rate_hz / 2
    places = [None] + list(range(len(nominal.channels))) * (len(nominal.channels) > 1)
    for c in places:
        def low_pass(n, x, w, c=c):
            response = 1 / (1 - w ** 2 + 1j * np.sqrt(2) * w)
            return filter_of(n, c, response if x[0] > 0 else 1 / response), None

        def analogue(n, x, low_pass=low_pass):
            return low_pass(n, x, nyquist_share(n) * abs(x[0]))

        def digital(n, x, low_pass=low_pass):
            # the same filter on samples: its frequencies are those of the bilinear transform
            corner = np.tan(np.pi / 2 / (1 + abs(x[0])))
            return low_pass(n, x, np.tan(np.pi / 2 * nyquist_share(n)) / corner)
        form = Form({'channel': 'all' if c is None else nominal.channels[c]}, (
            Number('corner_hz', 'Hz', 0.4, -50, 50, lambda x: half / max(abs(x), 1e-9)),),
            analogue, 'a low-pass that one recording has and the other has not',
            ModalPattern.COMMON_FILTER if c is None else None)
        number = replace(form.numbers[0], value=lambda x: half / (1 + abs(x)))
        yield replace(form, variants=(
            replace(form, on_samples=True),
            replace(form, numbers=(number,), change=digital),
            replace(form, numbers=(number,), change=digital, on_samples=True)))


@modal_form('sensor_noise')
def noise(nominal):
    """Yield white noise of each channel, over the noise floor of the reference."""
    for c, name in enumerate(nominal.channels):
        yield Form({'channel': name}, (
            Number('scale', '1', 0.1, -0.9, 1e8, lambda x: np.sqrt(1 + x)),),
            lambda n, x, c=c: (None, _noise_of(n, c, x[0] * n.floor[c])),
            'white noise over the floor of the reference, which is an upper bound of its noise')


@modal_form('sensor_drift')
def slow_noise(nominal):
    """Yield slow noise of each channel, eq. (88)."""
    low = nominal.cut.ends_hz[0]
    for c, name in enumerate(nominal.channels):
        for start in LAGS:
            tau = start / (2 * np.pi * low)

            def change(n, x, c=c, tau=tau):
                shape = (1 + (2 * np.pi * tau * n.cut.ends_hz[0]) ** 2) / (
                    1 + (2 * np.pi * tau * n.cut.middles_hz) ** 2)
                return None, _noise_of(n, c, x[0] * n.spectrum[0, c, c].real * shape)
            rms = np.sqrt(nominal.spectrum[0, c, c].real
                          * (1 + (2 * np.pi * tau * low) ** 2) / (4 * tau))
            number = Number('rms_m_s2', 'm/s^2', 0.1, -0.5, 1e10,
                            lambda x, rms=rms: rms * np.sqrt(max(x, 0.0)))
            yield Form({'channel': name}, (number,), change,
                       f'slow noise of a time constant of about {tau:.2g} s')


@modal_form('timestamp_jitter')
def jitter(nominal):
    """Yield jitter of the sampling instants: high frequencies fade into white noise, eq. (148)."""
    rate = nominal.cut.rate_hz

    def change(n, x):
        w2 = (np.pi * nyquist_share(n)) ** 2            # (omega / rate)^2
        lost = -np.expm1(np.clip(-w2 * x[0], -20, 20))  # goes into white noise
        white = (lost[:, None, None] * n.spectrum).mean(axis=0)
        return filter_of(n, None, np.sqrt(1 - lost)), np.tile(white, (n.cut.bands, 1, 1))
    yield Form({}, (
        Number('rms_s', 's', 1e-3, -0.5, 400.0, lambda x: np.sqrt(max(x, 0.0)) / rate),), change,
        on_samples=True)


@modal_form('sensor_misplacement')
def misplacement(nominal):
    """Yield the components of all modes at one channel, each changed on its own, eq. (180)."""
    # Of two channels either may have moved, or the structure may have changed.
    modes, width = nominal.modes, len(nominal.channels)
    if not len(modes) or width < LEAST_CHANNELS:
        return
    picks = mode_picks(nominal)
    for c, name in enumerate(nominal.channels):
        def change(n, x, c=c):
            gains = np.tile(np.eye(width, dtype=complex), (n.cut.bands, 1, 1))
            gains[:, c] += np.tensordot(x, picks, 1)
            return gains, None
        yield Form({'channel': name}, tuple(
            Number(f'component_{at_mode(f)}', '1', 0.01, -3.0, 3.0)
            for f in modes.frequencies_hz), change,
            'the mode shapes changed at one channel and not at the others',
            ModalPattern.CHANNEL_SHAPE)


def mode_picks(nominal):
    """Return the rows that pick each mode out of the channels where it dominates, (m, b, l)."""
    # It does so up to half-way to the next; those within reach are separated by their shapes.
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


def at_mode(frequency_hz):
    """Return the end of a parameter's name that says which mode, free of dots."""
    return f'at_{1000 * frequency_hz:.0f}_mhz'
