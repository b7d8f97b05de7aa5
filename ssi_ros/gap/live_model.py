"""What the live gap meter needs of the model, made once: templates and the bets on them."""
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import effect_class, inject, library
from ssi_ros.effects.stream import stream_setup, stretches
from ssi_ros.gap.alarm import Bank, bets_on
from ssi_ros.gap.candidate import Candidate, starting_points
from ssi_ros.gap.expected import Expected
from ssi_ros.gap.fit import Simulator
from ssi_ros.gap.likelihood import hermitian, real_vectors, white
from ssi_ros.gap.live_holes import autocovariance
from ssi_ros.gap.live_score import sight, statistics
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import Frame, make_frame, spectra
from ssi_ros.quantity import check, quantity
from ssi_ros.records import Samples
from threadpoolctl import ThreadpoolController

BLAS = ThreadpoolController()       # more threads only slow these small matrices down
COARSE = 12             # bands in which the power of each channel is watched, whatever the cause
LEVEL_ALIKE = 1e-3      # share of a template that must be left when the levels are taken out
CALIBRATION_HOPS = 1000
CALIBRATION_SEED = 20161
LAGS = 3                # hops after which nothing of a state is left
LEAST_MEANS = 20        # hops that the constant part of a channel is taken from
SHARES = {'library': 0.8, 'power': 0.1, 'line': 0.1}    # of the mixture of bets


@dataclass(frozen=True)
class LiveSettings:
    """Settings of the gap meter on sliding windows and of its alarm."""

    window_s: float = quantity(600.0, unit='s', low=10.0, high=1e6, live=False,
                               doc='window of the meter, whole hops')
    hop_s: float = quantity(30.0, unit='s', low=1.0, high=3600.0, live=False,
                            doc='a result every so often; the length of a piece of spectra')
    low_hz: float = quantity(0.1, unit='Hz', low=0.0, high=1e4, live=False,
                             doc='lowest frequency used')
    high_share: float = quantity(0.98, low=0.05, high=1.0, live=False,
                                 doc='highest frequency used, as a share of half of the rate')
    band_bins: int = quantity(8, low=1, high=1000, live=False,
                              doc='frequency bins of a band of the meter')
    missing_share: float = quantity(0.1, low=0.0, high=0.5,
                                    doc='a hop that lacks more of its rows is left out')
    false_alarm_every_s: float = quantity(
        2592000.0, unit='s', low=600.0, high=1e10,
        doc='least mean time between false alarms (default: 30 days)')

    def __post_init__(self):
        check(self)
        if self.window_s < self.hop_s:
            raise ValueError(f'window_s={self.window_s:g} is shorter than hop_s={self.hop_s:g}; '
                             'a window holds at least one hop')


@dataclass(frozen=True, eq=False)
class LiveModel:
    """
    The nominal side of the live meter.

    Attributes
    ----------
    simulator : Simulator
        Of the nominal spacecraft; its `expected` without effects is computed once.
    frame : Frame
        Of one piece, without missing rows.
    expected : Expected
        Periodograms of such a piece.
    names, sites : tuple of str
        Of each of the t templates: the effect and its site; 'unknown' and '' for those that
        watch the power of a channel in a band, whatever the cause.
    texts : tuple of str
        What each of the t + k statistics watches, in words.
    templates : ndarray, shape (t, k l l), float32
        Whitened directions, of norm 1.
    line : ndarray, shape (k, l), complex
        Response of the channels to a torque about x_b in every bin.
    covariance : ndarray, shape (m, l, l)
        Autocovariance at the first lags, which fills missing samples.
    bank : Bank
        The bets on templates and lines.

    """

    simulator: Simulator
    frame: Frame
    expected: Expected
    names: tuple
    sites: tuple
    texts: tuple
    templates: np.ndarray
    line: np.ndarray
    covariance: np.ndarray
    bank: Bank = None

    def cause(self, statistic):
        """Return what a statistic stands for: an effect, a line, or the power of a channel."""
        known = statistic < len(self.names) and self.names[statistic] != 'unknown'
        return self.names[statistic] if known else self.texts[statistic]


class _Nominal(Simulator):
    """The simulator of a model whose own spectrum is computed once."""

    _kept = None

    def expected(self, candidate, levels=None, near=None):
        if candidate.effects:
            return super().expected(candidate, levels, near)
        if self._kept is None:
            self._kept = super().expected(candidate)
        return self._kept


def prepare(spacecraft, settings=LiveSettings(), *, present=(), effects=None, progress=None):
    """
    Make what the live meter needs of the model.

    Parameters
    ----------
    spacecraft : Spacecraft
        The nominal model.
    settings : LiveSettings
        Window, hop and band.
    present : tuple of Effect
        Effects that the model already has.
    effects : sequence of str, optional
        Names of the effects to watch; all by default.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    LiveModel

    Raises
    ------
    ValueError
        If the hop is too short, or an effect of the model needs the length of a record.

    """
    with BLAS.limit(limits=1):
        return _prepare(spacecraft, settings, present, effects, progress or (lambda share: None))


def _prepare(spacecraft, settings, present, effects, tell):
    for e in present:
        if stretches(inject(spacecraft, [e], settings.window_s)):
            raise ValueError(f'the model has {e.name}, which stretches over a record; a live '
                             'stream has no end, so take it out of the model')
    frame = _frame(spacecraft.rate_hz, settings)
    simulator = _Nominal(spacecraft, frame, settings.window_s, present)
    nominal = simulator.expected(Candidate())
    base = nominal.at(np.ones(len(nominal.names)))
    lower = np.linalg.inv(np.linalg.cholesky(base))
    names, sites, texts, rows = [], [], [], []

    levels = np.linalg.qr(np.array([real_vectors(white(lower, share))[0]
                                    for share in nominal.shares]).T)[0]

    def add(name, site, text, change):
        row = real_vectors(white(lower, change))[0]
        left = row - levels @ (levels.T @ row)
        size = np.linalg.norm(left)
        # what only changes the levels within a piece cannot be told from them
        if size > LEVEL_ALIKE * np.linalg.norm(row):
            names.append(name), sites.append(site), texts.append(text)
            rows.append((left / size).astype(np.float32))

    starts = _starts(spacecraft, settings, effects)
    for i, effect in enumerate(starts):
        tell(0.5 * i / len(starts))
        there = simulator.expected(Candidate((effect,)))
        if there is not None:
            add(effect.name, effect.site.value, effect.text(),
                there.at(np.ones(len(there.names))) - base)
    system = simulator.setup(Candidate()).system
    for text, change in _powers(base, frame, system.channels):
        add('unknown', '', text, change)
    line = system.transfer(frame.frequencies_hz, system.rate_hz)[
        :, :, system.inputs.index('torque_x')]
    texts += [f'line at {f:.4g} Hz' for f in frame.frequencies_hz]
    model = LiveModel(simulator, frame, nominal, tuple(names), tuple(sites), tuple(texts),
                      np.array(rows), line, autocovariance(simulator))
    return replace(model, bank=_bank(model, _repeats(model, settings, tell)))


def _frame(rate_hz, settings):
    """Return the frame of one piece of a hop's length."""
    cut = DiagnosisSettings(segment_s=settings.hop_s, low_hz=settings.low_hz, least_segments=4,
                            high_share=settings.high_share, band_bins=settings.band_bins)
    try:
        return replace(make_frame(4 * round(settings.hop_s * rate_hz), rate_hz, cut), pieces=1)
    except ValueError:
        raise ValueError(f'hop_s={settings.hop_s:g} has too few frequency bins at {rate_hz:g} Hz; '
                         f'{16 * settings.band_bins / rate_hz:g} or more is needed') from None


def _starts(spacecraft, settings, effects):
    """Return the effects at their starting values, without those that stretch over a record."""
    classes = [effect_class(n) for n in effects] if effects else list(library().values())
    return [e for e in starting_points(classes, spacecraft)
            if not stretches(inject(spacecraft, [e], settings.window_s))]


def _powers(base, frame, channels):
    """Yield text and change: more power of one channel in one band."""
    for bins in np.array_split(np.arange(len(base[0])), COARSE):
        low, high = frame.frequencies_hz[bins[[0, -1]]]
        for i, channel in enumerate(channels):
            change = np.zeros_like(base)
            change[0, bins, i, i] = base[0, bins, i, i]
            yield f'power of {channel} at {low:.3g} to {high:.3g} Hz', change


def _repeats(model, settings, tell):
    """
    Return how much more each statistic varies in the long run than eq. (131) alone says.

    Hops that follow each other share the state of slow modes, and bins share the skirt of a
    resonance that is narrower than they are. Both are seen in CALIBRATION_HOPS of the model's
    own simulation: variance times 1 + 2 sum of autocorrelations, eq. (133), at least 1.
    """
    simulator, frame = model.simulator, model.frame
    _, _, blocks = stream_setup(simulator.spacecraft, simulator.present, CALIBRATION_SEED,
                                block_s=settings.hop_s)
    seen = sight(model, np.ones(len(model.expected.names)))
    means, found = deque(maxlen=LEAST_MEANS), []
    for hop, block in zip(range(CALIBRATION_HOPS), blocks):
        tell(0.5 + 0.5 * hop / CALIBRATION_HOPS)
        rows = block.values[:frame.rows]
        means.append(rows.mean(axis=0))
        samples = Samples(rows - np.mean(means, axis=0), frame.rate_hz, block.channels)
        found.append(statistics(model, seen, spectra(samples, frame)[0]))
    found = np.array(found) - np.mean(found, axis=0)
    variance = np.mean(found ** 2, axis=0)
    again = sum(np.mean(found[i:] * found[:-i], axis=0) for i in range(1, LAGS + 1)) / variance
    return np.maximum(variance, 1.0) * np.maximum(1.0 + 2.0 * again, 1.0)


def _bank(model, repeats):
    """Return the bets: the library's names share its part of the mixture evenly."""
    statistic, tilt, price, weight = [], [], [], []

    def add(number, bets, share):
        for t, p in bets:
            statistic.append(number), tilt.append(t), price.append(p)
            weight.append(share / len(bets))

    names, count = model.names, model.line.shape[1]
    known = set(names) - {'unknown'}
    for i, (name, row) in enumerate(zip(names, model.templates)):
        part = SHARES['power'] if name == 'unknown' else SHARES['library'] / len(known)
        eigenvalues = np.linalg.eigvalsh(hermitian(row.reshape(-1, count, count)))
        add(i, bets_on(eigenvalues.ravel(), model.frame.crowding, repeats[i]),
            part / names.count(name))
    for k, again in enumerate(repeats[len(names):]):
        # an exponential variable of mean 1 less 1, in one bin: no neighbours to count
        bets = [b for b in bets_on(np.ones(1), 1.0, again) if b[0] > 0.0]
        add(len(names) + k, bets, SHARES['line'] / len(model.line))
    weight = np.array(weight)
    return Bank(np.array(statistic), np.array(tilt), np.array(price),
                np.log(weight / weight.sum()))
