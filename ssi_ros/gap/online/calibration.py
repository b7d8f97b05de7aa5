"""The calibration of the live gap meter: templates of the model, and the bets on them."""
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import applicable, effect_class, inject
from ssi_ros.effects.stream import stream_setup, stretches
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.whittle import BLAS
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.nominal.starting_points import starting_points
from ssi_ros.gap.online.e_detector import Bank, bets_on
from ssi_ros.gap.online.imputation import autocovariance
from ssi_ros.gap.online.thresholds import LIMITS
from ssi_ros.gap.online.window_statistics import level_basis, project, statistics
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.expected_periodogram import Expected
from ssi_ros.gap.spectra.segmentation import Frame, make_frame, spectra
from ssi_ros.hermitian import hermitian, inverse_root, white_vectors
from ssi_ros.quantity import check, quantity
from ssi_ros.records import Samples
from ssi_ros.updating.live_bias import bet_beside, largest_bias

COARSE = 12             # bands in which the power of each channel is watched, whatever the cause
CALIBRATION_HOPS = 1000
CALIBRATION_SEED = 20161
LAGS = 3                # hops after which a state has decayed
LEAST_MEANS = 20        # hops that the bias of a channel is the mean of
SHARES = {'library': 0.8, 'power': 0.1, 'line': 0.1}    # of the mixture of bets


@dataclass(frozen=True)
class LiveSettings:
    """Settings of the gap meter on sliding windows and of its alarm."""

    window_s: float = quantity(600.0, unit='s', low=10.0, high=1e6, live=False,
                               doc='window of the meter, whole hops')
    hop_s: float = quantity(30.0, unit='s', low=1.0, high=3600.0, live=False,
                            doc='a result every so often; the length of a segment of spectra')
    low_hz: float = quantity(0.1, unit='Hz', low=0.0, high=1e4, live=False,
                             doc='lowest frequency used')
    high_share: float = quantity(0.98, low=0.05, high=1.0, live=False,
                                 doc='highest frequency used, as a share of half of the rate')
    band_bins: int = quantity(8, low=1, high=1000, live=False,
                              doc='frequency bins of a band of the meter')
    missing_share: float = quantity(0.005, low=0.0, high=0.5,
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
    """The nominal side of the live meter."""

    simulator: Simulator    # of the nominal spacecraft; its own spectrum is computed once
    frame: Frame            # of one hop, without missing rows
    expected: Expected      # periodograms of such a hop
    names: tuple            # effect of each of the t templates; 'unknown' of power of a channel
    sites: tuple            # site of each effect; '' of the power of a channel
    texts: tuple            # of each of the t + k statistics, in words
    templates: np.ndarray   # (t, k l l), float32, whitened directions of norm 1
    line: np.ndarray        # (k, l), response to the largest torque of the model in every bin
    covariance: np.ndarray  # (m, l, l), autocovariance at the first lags, for missing samples
    bank: Bank = None       # the bets on templates and lines

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


@BLAS.wrap(limits=1)
def prepare(spacecraft, settings=LiveSettings(), *, present=(), effects=None, progress=None):
    """
    Calibrate the live meter on the model.

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
    report = progress or (lambda share: None)
    for e in present:
        if stretches(inject(spacecraft, [e], settings.window_s)):
            raise ValueError(f'the model has {e.name}, which is defined over a whole record; a '
                             'live stream has no end, so take it out of the model')
    frame = _frame(spacecraft.rate_hz, settings)
    simulator = _Nominal(spacecraft, frame, settings.window_s, present)
    classes = [effect_class(n) for n in applicable(spacecraft, effects)]
    starts = [e for e in starting_points(classes, spacecraft)
              if not stretches(inject(spacecraft, [e], settings.window_s))]
    names, sites, texts, rows = zip(*_templates(simulator, starts, report))
    system = simulator.setup(Candidate()).system
    line = system.transfer(frame.frequencies_hz, system.rate_hz)[:, :, 0]
    texts += tuple(f'line at {f:.4g} Hz' for f in frame.frequencies_hz)
    model = LiveModel(simulator, frame, simulator.expected(Candidate()), names, sites, texts,
                      np.array(rows), line, autocovariance(simulator))
    return replace(model, bank=_bank(model, _long_run_variance(model, settings, report)))


def _frame(rate_hz, settings):
    """Return the frame of one hop."""
    cut = DiagnosisSettings(segment_s=settings.hop_s, low_hz=settings.low_hz, least_segments=4,
                            high_share=settings.high_share, band_bins=settings.band_bins)
    try:
        return replace(make_frame(4 * round(settings.hop_s * rate_hz), rate_hz, cut), begins=(0,))
    except ValueError:
        raise ValueError(f'hop_s={settings.hop_s:g} has too few frequency bins at {rate_hz:g} Hz; '
                         f'{16 * settings.band_bins / rate_hz:g} or more is needed') from None


def _templates(simulator, starts, report):
    """Yield effect, site, text and direction (k l l,), of norm 1, of all templates."""
    nominal = simulator.expected(Candidate())
    lower = inverse_root(nominal.at_nominal)
    levels = level_basis(nominal.shares, lower)
    for *labels, change in _changes(simulator, nominal.at_nominal, starts, report):
        row = white_vectors(lower, change)[0]
        rest = row - levels @ (levels.T @ row)
        size = np.linalg.norm(rest)
        # a change of the levels alone is no gap
        if size > LIMITS.level_share.value * np.linalg.norm(row):
            yield *labels, (rest / size).astype(np.float32)


def _changes(simulator, base, starts, report):
    """Yield effect, site, text and change of each start, and of each channel's power in a band."""
    for i, effect in enumerate(starts):
        report(0.5 * i / len(starts))
        there = simulator.expected(Candidate((effect,)))
        if there is not None:
            yield effect.answer, effect.site.value, effect.text(), there.at_nominal - base
    for bins in np.array_split(np.arange(base.shape[1]), COARSE):
        low, high = simulator.frame.frequencies_hz[bins[[0, -1]]]
        for i, sensor in enumerate(simulator.spacecraft.sensors):
            change = np.zeros_like(base)
            change[0, bins, i, i] = base[0, bins, i, i]
            yield ('unknown', '', f'power of {sensor.name} at {low:.3g} to {high:.3g} Hz', change)


def _long_run_variance(model, settings, report):
    """
    Return the variance of each statistic in the long run over that of eq. (131).

    Adjoining hops share the state of slow modes, and bins the skirt of a resonance that is
    narrower than they are. Both are estimated from CALIBRATION_HOPS of a simulation of the model:
    variance times 1 + 2 sum of autocorrelations, eq. (133), at least 1.
    """
    simulator, frame = model.simulator, model.frame
    _, _, blocks = stream_setup(simulator.spacecraft, simulator.present, CALIBRATION_SEED,
                                block_s=settings.hop_s)
    projection = project(model, np.ones(len(model.expected.names)))
    means, found = deque(maxlen=LEAST_MEANS), []
    for hop, block in zip(range(CALIBRATION_HOPS), blocks):
        report(0.5 + 0.5 * hop / CALIBRATION_HOPS)
        rows = block.values[:frame.rows]
        means.append(rows.mean(axis=0))
        samples = Samples(rows - np.mean(means, axis=0), frame.rate_hz, block.channels)
        found.append(statistics(model, projection, spectra(samples, frame)[0]))
    found = np.array(found) - np.mean(found, axis=0)
    variance = np.mean(found ** 2, axis=0)
    repeated = sum(np.mean(found[i:] * found[:-i], axis=0) for i in range(1, LAGS + 1)) / variance
    return np.maximum(variance, 1.0) * np.maximum(1.0 + 2.0 * repeated, 1.0)


def _bank(model, variances):
    """Return the bets: the effects of the library share its part of the mixture evenly."""
    # what a calibration has left unknown is no gap: a bet pays for the largest bias
    names, count = model.names, model.line.shape[1]
    bias, of_lines = largest_bias(model)
    known, found = set(names) - {'unknown'}, []
    for i, (name, row) in enumerate(zip(names, model.templates)):
        part = SHARES['power'] if name == 'unknown' else SHARES['library'] / len(known)
        eigenvalues = np.linalg.eigvalsh(hermitian(row.reshape(-1, count, count)))
        bets = bets_on(eigenvalues.ravel(), model.frame.inflation, variances[i])
        found += [(i, tilt, price + abs(tilt) * bias[i], part / names.count(name) / len(bets))
                  for tilt, price in bets]
    for i, (variance, bias) in enumerate(zip(variances[len(names):], of_lines), len(names)):
        # an exponential variable of mean 1 less 1, in one bin without neighbours
        bets = [bet_beside(bias, *b) for b in bets_on(np.ones(1), 1.0, variance) if b[0] > 0.0]
        found += [(i, *b, SHARES['line'] / len(model.line) / len(bets)) for b in bets]
    statistic, tilt, price, weight = np.array(found).T
    return Bank(statistic.astype(int), tilt, price, np.log(weight / weight.sum()))
