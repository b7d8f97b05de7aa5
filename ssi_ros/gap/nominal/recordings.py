"""Two recordings of one structure, prepared: what all tests of the second one work on."""
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.registry import detectors
from ssi_ros.events.contacts import contact_of, not_from_outside
from ssi_ros.events.prediction_error import predictor
from ssi_ros.gap.check import TooLittleData
from ssi_ros.gap.inference.goodness_of_fit import compare
from ssi_ros.gap.nominal.modal.amplitude_dependence import amplitude_dependence
from ssi_ros.gap.nominal.modal.fit import fit, Fitted
from ssi_ros.gap.nominal.modal.mixed_halves import floor_of_halves
from ssi_ros.gap.nominal.modal.reference import identified, make_nominal, Nominal
from ssi_ros.gap.nominal.modal.score_test import ModalScoreTest, score_forms
from ssi_ros.gap.nominal.modal.starting_values import all_forms
from ssi_ros.gap.nominal.pairing import dither_of, dithered, make_pair, noisy, Pair
from ssi_ros.gap.nominal.periodic.detections import both_repeat, in_phase
from ssi_ros.gap.nominal.periodic.period import period_of
from ssi_ros.gap.nominal.periodic.random_walk import independent_share
from ssi_ros.gap.nominal.periodic.repeats import ENOUGH_PERIODS, same_signal
from ssi_ros.gap.nominal.stationary import chirp, impulses, level, samples, tone
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.gap.spectra.band_averages import Cut, level_of, plan, Spectra
from ssi_ros.levels.free import compared
from ssi_ros.regimes.assess import regime_of
from ssi_ros.regimes.frequency_shift import modes_again, shifted_modes
from ssi_ros.regimes.odd_channels import odd_channels
from ssi_ros.regimes.varying_level import steady_share

SOURCES = 'recordings', 'periods'
DETECTORS = chirp, impulses, level, samples, tone    # they enter themselves in the registry


@dataclass(frozen=True, eq=False)
class Recordings:
    """A reference and a record, brought together."""

    effects: tuple          # names that are considered
    notes: tuple            # what was left out or changed
    raw: tuple              # reference and record as recorded, (n, l) each
    clean: Pair             # both from one row of the excitation on
    pair: Pair              # the same with equal white noise added
    repeats: tuple          # periods of both, or None where the excitation does not repeat itself
    delay_s: float          # time after the start of the record at which `clean` begins [s]
    full_cut: Cut           # all bands
    full_mean: np.ndarray   # mean spectrum of the reference in them, (b, l, l)
    level: float            # logarithm of the power of the record over that of the reference
    clear_level: float      # the same, 0 where not significant
    nominal: Nominal        # spectrum, noise and modes of the reference
    one: Spectra            # reference in the bands that are compared
    two: Spectra            # record in the same
    null: Fitted            # level and noise alone
    turn: np.ndarray        # (b, l, l), filter of the reference to the levels of the record

    @property
    def enough_periods(self):
        """Whether both recordings repeat themselves so often that the rest can be judged."""
        repeats = self.repeats or ()
        return min((len(r.periods) for r in repeats), default=0) >= ENOUGH_PERIODS

    @cached_property
    def predictors(self):
        """Return reference and record, (n, l) each, with their Predictor."""
        return [(v, predictor(v)) for v in (self.pair.reference, self.pair.record)]

    @cached_property
    def prediction_errors(self):
        """Return what the past does not predict of reference and record, each (n, l)."""
        return tuple(way.residual(v) for v, way in self.predictors)

    @cached_property
    def slew_normalised(self):
        """Return the same, whitened again by how fast the motion is at each row, eq. (161c)."""
        return tuple(way.slew_normalised(v, e)
                     for (v, way), e in zip(self.predictors, self.prediction_errors))

    @cached_property
    def group_levels(self):
        """Power of what the past does not predict in every group, over its mean, (g,)."""
        power, weights = (self.prediction_errors[1] ** 2).mean(axis=1), self.two.weights
        ends = np.rint(np.cumsum(weights) / weights.sum() * len(power)).astype(int)
        found = np.array([p.mean() for p in np.split(power, ends[:-1])])
        return found / (found @ weights / weights.sum())

    @cached_property
    def score_test(self):
        """Score test of all modal forms around the null; of detections alone there are none."""
        forms = all_forms(self.nominal, self.effects)
        if not forms:
            return ModalScoreTest((), (), *(np.zeros(0),) * 3, 1.0, tracks=np.zeros((0, 0)))
        return score_forms(self.nominal, self.null, self.one, self.two, forms, self.enough_periods)

    @cached_property
    def regime(self):
        """Kind of motion that both hold, and which effects may be named of it."""
        return regime_of(self)

    @cached_property
    def odd_channels(self):
        """Return Detections of channels that do what nothing linear and steady makes of them."""
        return odd_channels(self)

    @cached_property
    def contact(self):
        """Return what shows that impulses follow the motion, a Detection of no effect or none."""
        return contact_of(self, self.all_detections[0])

    @cached_property
    def record_modes(self):
        """Modes of the record, identified as those of the reference were."""
        return identified(self.pair.record, self.pair.channels, self.pair.rate_hz)

    @cached_property
    def shift(self):
        """Whether frequencies of modes differ between the recordings."""
        return shifted_modes(self._modes_again, self.nominal.cut.width_hz)

    @cached_property
    def moved(self):
        """Return the same, of modes that moved by any width."""
        return shifted_modes(self._modes_again)

    @cached_property
    def _modes_again(self):
        """Modes that both hold; of other than random motion there are none."""
        return modes_again(self.nominal.identified,
                           () if self.regime.unsteady else self.record_modes)

    @cached_property
    def dependence(self):
        """How the modes of the record depend on their amplitude, beyond those of the reference."""
        modes, rate_hz = self.nominal.modes, self.pair.rate_hz
        found = amplitude_dependence(self.pair.record, rate_hz, modes)
        if self.repeats is None:
            return found
        lines = (2 * modes.damping_ratios * modes.frequencies_hz
                 * len(self.repeats[0].mean) / rate_hz)
        return found.beside(amplitude_dependence(self.pair.reference, rate_hz, modes), lines)

    @cached_property
    def floor_factors(self):
        """Mean and standard deviation of the gap between mixed halves over theory, at least 1."""
        theory = compare(self.one, self.two, self.null.prediction, self.nominal.trust)
        noise = self.null.x[1] * np.diag(self.nominal.floor)
        level = replace(self.one, groups=np.exp(self.null.x[0]) * self.one.groups + noise)
        floor, std = floor_of_halves(level, self.two, self.nominal.trust)
        return max(floor / theory.floor, 1.0), max(std / theory.floor_std, 1.0)

    @cached_property
    def detections(self):
        """Those of effects that can have made it, and the number of tests that chance passes."""
        found, tests = self.all_detections
        return (not_from_outside(found) if self.contact else found), tests

    @cached_property
    def all_detections(self):
        """All detections in the record, and the number of tests that chance could have passed."""
        found, tests = {}, 0
        for source in SOURCES[:1 if self.repeats is None else 2]:
            for name, detector in detectors(source).items():
                effect = effect_class(name)
                detection = detector(effect, self)
                # what is read off the samples is exact
                tests += ModalPattern.SAMPLE_VALUES not in effect.patterns
                if detection is not None and detection.effect in self.effects and (
                        self.regime.allows(detection.effect, len(detection.times) > 0)):
                    # what periods show of an effect replaces what the samples show of it
                    found[detection.effect] = detection
        return tuple(found.values()), tests


def prepare(reference, record, effects):
    """Bring two recordings (Samples, NaN where a sample is missing) together, a `Recordings`."""
    # ValueError if they have no channel in common or rates in no ratio of small whole numbers;
    # TooLittleData if the shorter one has too few segments.
    whole = make_pair(reference, record)
    period = period_of(dithered(whole).reference)
    repeats = both_repeat(whole, period)
    clean = in_phase(whole, repeats)
    pair = dithered(clean)
    try:
        full_cut = plan(min(len(pair.reference), len(pair.record)), pair.rate_hz,
                        len(pair.channels), period)
        one, two = pair.spectra(full_cut)
    except ValueError as error:
        raise TooLittleData(str(error), pair.notes) from None
    full_mean = one.mean
    level, std = level_of(full_mean, two.mean, one.freedom, two.freedom)
    clear_level = level if abs(level) > LIMITS.clear_level.value * std else 0.0

    def nominal_of(spectra):
        cut = spectra.cut
        found = make_nominal(pair.reference, pair.channels, cut, spectra.mean, spectra)
        if repeats is None:
            return found
        dither = 2 / pair.rate_hz * np.square(dither_of(clean))
        return found.trusted(independent_share(repeats[0], cut, same_signal(*repeats))).trusted(
            steady_share(repeats[:1 if clear_level else 2], dither, cut,
                         (one.freedom, two.freedom)))

    def noisier(powers):
        return noisy(pair, np.sqrt(powers * pair.rate_hz / 2)).spectra(full_cut)
    there = compared(nominal_of, one, two, effects, noisier)
    full_mean = there.in_all_bands(full_mean, full_cut, level)
    raw = tuple(s.values[:, [s.channels.index(c) for c in pair.channels]]
                for s in (reference, record))
    return Recordings(effects, pair.notes + there.notes, raw, clean, pair, repeats,
                      (len(whole.record) - len(clean.record)) / clean.rate_hz, full_cut, full_mean,
                      level, clear_level, there.nominal, there.one, there.two,
                      fit(there.nominal, there.record), there.turn)
