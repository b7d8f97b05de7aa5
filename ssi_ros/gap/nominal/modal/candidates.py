"""Candidates of a recorded nominal, and what is reported of a fitted one."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.gap.diagnosis import Value
from ssi_ros.gap.nominal.forms import local_change
from ssi_ros.gap.nominal.forms.candidate import ModalCandidate
from ssi_ros.gap.nominal.forms.mode_coupling import mixed_modes, moved_stiffness
from ssi_ros.gap.nominal.modal.fit import masking_gain, ratio, residual_of, whitened
from ssi_ros.gap.nominal.modal.prediction import Averages, predict
from ssi_ros.gap.nominal.modal.reference import modes_of
from ssi_ros.gap.nominal.modal.starting_values import begun, best_forms, moved_forms, nearest_forms
from ssi_ros.gap.nominal.stationary.samples import EXACT
from ssi_ros.gap.nominal.thresholds import LIMITS

BOUND = 1.645           # standard deviations of a 90 % interval
SHIFTED = ModalPattern.COMMON_FREQUENCY_RATIO, ModalPattern.MODE_FREQUENCIES
NAN = float('nan')


def singles(recordings, joint, far):
    """Return the single effects that the tests speak for, of any size where starts are far."""
    nominal, test = recordings.nominal, recordings.score_test
    found = [f for d in _one_cause_of_bursts(recordings.detections[0], *joint)
             for f in _forms_of(recordings, d)]
    found += best_forms(test)
    if far:
        found += nearest_forms(recordings, test.forms)
        found += moved_forms(nominal, modes_of(nominal, recordings.record_modes), test.forms)
        found += mixed(recordings)
        found += [begun(nominal, f, recordings.two.mean) for f in test.forms
                  if f.pattern is ModalPattern.CHANNEL_SHAPE]
    if recordings.shift.text:
        found += [f for f in test.forms if f.pattern in SHIFTED]
    return candidates_of(recordings, found)


def candidates_of(recordings, forms):
    """Return forms as candidates, with the odds that the frequencies of modes give them."""
    return tuple(ModalCandidate((recordings.shift.weighted(f),)) for f in forms)


def mixed(recordings):
    """Return the forms of modes whose shapes turn as well, in a list that may be empty."""
    nominal = recordings.nominal
    there = modes_of(nominal, recordings.record_modes)
    forms = filter(None, (mixed_modes(nominal, there), *_local(recordings, there)))
    return [f for f in forms if {f.effect, *f.equivalents} & set(recordings.effects)]


def _local(recordings, there):
    """Yield the forms of a spring or mass and of a damper, begun nearest to the record."""
    nominal, null = recordings.nominal, recordings.null
    if len(nominal.modes) < 2:
        return
    record = Averages(recordings.two.mean, recordings.one.freedom, recordings.two.freedom)

    def likelihood(form):
        there = predict(nominal, (form,), np.append(null.x, form.start))
        return ratio(there.turned(null.turn), record, nominal.trust)
    residual, lower = residual_of(nominal, record, null)
    spring, damper = (local_change.from_scores(
        nominal, np.exp(null.x[0]) * nominal.spectrum, residual,
        lambda change: np.sqrt(record.weight) * whitened(change, lower), d) for d in (False, True))
    forms = [spring]
    moved, ties = moved_stiffness(nominal.modes, there)
    if moved.any():
        forms.append(local_change.from_frequencies(nominal, np.expm1(moved), ties, likelihood))
    yield max(forms, key=likelihood)
    yield damper


def _one_cause_of_bursts(detections, joint, bursts):
    """Return the detections without the weaker of impulses and of a joint that impacts."""
    found = list(detections)
    impulses = [d for d in found if ModalPattern.IMPULSES in effect_class(d.effect).patterns]
    if joint is not None and joint.effect:
        found.append(joint)
        if impulses and bursts > 0.0:
            found.remove(impulses[0] if bursts > _log_odds(impulses[0]) else joint)
    return found


def _forms_of(recordings, detection):
    """Return the forms of a detection, with its odds and those of the cells that they mask."""
    for form in detection.basis(recordings):
        form = replace(
            form, effect=detection.effect, meaning=form.meaning or detection.text,
            constants={n: (v, _unit(n)) for n, v in detection.parameters.items()})
        gain = masking_gain(recordings.nominal, recordings.null, recordings.one, recordings.two,
                            form)
        yield replace(form, bonus=(form.bonus or _log_odds(detection)) + max(gain, 0.0))


def _log_odds(detection):
    """Return the log odds of a detection, within what is believed."""
    if detection.weak:
        return 0.0
    if detection.p_value <= EXACT:
        return LIMITS.exact_odds.value
    return min(LIMITS.detection_odds.value, detection.log_odds)


def _unit(name):
    """Return the unit that the name of a quantity ends with."""
    ends = {'_m_s2': 'm/s^2', '_hz': 'Hz', '_s': 's', '_per_min': '1/min', 'ppm': '1e-6'}
    return next((unit for end, unit in ends.items() if name.endswith(end)), '1')


def parameters_of(fit):
    """Return the coordinates of the forms with their intervals, and what was read off."""
    stds, values = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0)), {}
    for form, at in zip(fit.candidate.forms, fit.candidate.slices):
        for number, x, std in zip(form.numbers, fit.estimate[at], stds[at]):
            reach = np.clip([x - BOUND * std, x + BOUND * std], number.low, number.high)
            low, high = sorted(float(number.value(v)) for v in reach)
            values[f'{form.effect}.{number.name}'] = Value(
                float(number.value(x)), (high - low) / (2 * BOUND), low, high, number.unit)
        for name, (value, unit) in form.constants.items():
            values[f'{form.effect}.{name}'] = Value(value, NAN, NAN, NAN, unit)
        for name, alike in form.near(fit.estimate[at]).items():
            values[f'{form.effect}.near.{name}'] = Value(alike, NAN, NAN, NAN, '1')
        # a channel is no number: it is named by the parameter
        for key in form.place.keys() & {'channel', 'source'}:
            values[f'{form.effect}.{key}.{form.place[key]}'] = Value(1.0, NAN, NAN, NAN, '1')
    return values
