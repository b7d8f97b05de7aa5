"""Detections in two recordings of one periodic excitation, eq. (170) to (177)."""
from dataclasses import replace
from functools import partial

import numpy as np

from ssi_ros.effects.registry import detects
from ssi_ros.events.single import carrier_rows
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.candidate import Form, Number
from ssi_ros.gap.nominal.periodic.modulation import modulation
from ssi_ros.gap.nominal.periodic.period import autocorrelation
from ssi_ros.gap.nominal.periodic.repeats import (
    at_instants, delay_between, LEAST_PERIODS, repeats_of, same_signal)
from ssi_ros.gap.nominal.periodic.residual_lines import line, sweep
from ssi_ros.gap.nominal.stationary.samples import EXACT, replacing
from ssi_ros.gap.nominal.stationary.tone import line_detection
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.gap.spectra.band_averages import spectra_of
from ssi_ros.hermitian import positive

GRID = 1000             # instants of a group at which a level is taken


def both_repeat(pair, period):
    """Return the Repeats of both recordings, undithered, or None where one has too few periods."""
    if period is None:
        return None
    both = [repeats_of(v, pair.rate_hz, period) for v in (pair.reference, pair.record)]
    return None if None in both else tuple(both)


def in_phase(pair, repeats):
    """Return recordings that begin at the same row of one signal, as lengths allow."""
    # A segment under its taper holds some of the signal and not all of it; begun elsewhere it
    # holds another part, and the spectra of the very same motion differ.
    if repeats is None:
        return pair
    delay, alike = delay_between(*repeats)
    if alike <= LIMITS.same_signal.value:
        return pair
    rows = len(repeats[0].mean)
    late = int(round(delay)) % rows
    sizes = len(pair.reference), len(pair.record)

    def whole_periods(cut):
        return min((n - c + 1) // rows for n, c in zip(sizes, cut)), -sum(cut)
    cut = max(((0, late), ((rows - late) % rows, 0)), key=whole_periods)
    if whole_periods(cut)[0] < LEAST_PERIODS:
        return pair
    return replace(pair, reference=pair.reference[cut[0]:], record=pair.record[cut[1]:],
                   missing=tuple(m[c:] for m, c in zip(pair.missing, cut)),
                   filled=tuple(f[c:] for f, c in zip(pair.filled, cut)))


def clock_error(one, two):
    """Return the error of the clock of the record [1e-6], None where insignificant, (172)."""
    ppm = float(1e6 * (one.period_rows / two.period_rows - 1))
    spread = 1e6 * np.hypot(one.period_std, two.period_std) / two.period_rows
    least = LIMITS.clock_ppm.value + LIMITS.clock_deviations.value * spread
    if abs(ppm) < least or not same_signal(one, two):
        return None
    return ppm


@detects('clock_rate', of='periods')
def clock(effect, recordings):
    """Detect a clock by the period of one signal."""
    (one, two), ppm = recordings.repeats, clock_error(*recordings.repeats)
    # of a machine that turns, which is periodic alone, the speed may differ as well
    if ppm is None or carrier_rows(autocorrelation(recordings.clean.record)):
        return None
    return Detection(
        effect.name, {'ppm': ppm}, EXACT,
        f'one signal repeats itself after {two.period_rows:.2f} rows of the record and '
        f'{one.period_rows:.2f} of the reference: a clock is wrong by {ppm:+.0f} ppm',
        basis=partial(_resampled, step=1 + 1e-6 * ppm))


def _resampled(recordings, step):
    """Return the form of a clock: the reference, sampled by it, (177)."""
    reference = recordings.clean.reference
    rows = np.arange(int((len(reference) - 1) / step) + 1) * step
    return (replacing(recordings, at_instants(reference, rows)),)


@detects('harmonic_disturbance', of='periods')
def line_between(effect, recordings):
    """Detect a line between those of the excitation."""
    found = None
    if recordings.enough_periods:
        found = line(*recordings.repeats, float(np.exp(recordings.level)))
    if found is None:
        return None
    return line_detection(
        effect.name, *found,
        f'a line at {found[1]:.5g} Hz between those of a signal that repeats itself')


@detects('wheel_speed_sweep', of='periods')
def sweep_between(effect, recordings):
    """Detect a line that moves through what does not repeat."""
    found = sweep(*recordings.repeats) if recordings.enough_periods else None
    if found is None:
        return None
    p, start, end = found
    return Detection(
        effect.name, {'start_hz': start, 'end_hz': end}, max(p, 10 * EXACT),
        f'a line that moves from {start:.4g} to {end:.4g} Hz in what does not repeat',
        basis=partial(_power_between, low_hz=min(start, end), high_hz=max(start, end)))


def _power_between(recordings, low_hz, high_hz):
    """Return the form of a sweep: the power that does not repeat, where it passed, (177)."""
    cut = recordings.nominal.cut
    one, two = (spectra_of(r.rest, cut).mean for r in recordings.repeats)
    passed = (cut.middles_hz > low_hz - cut.width_hz) & (cut.middles_hz < high_hz + cut.width_hz)
    added = positive(np.where(passed[:, None, None], two - one, 0.0))
    return (Form({}, (Number('relative_power', '1', 1.0, 0.0, 100.0),),
                 lambda n, x: (None, x[0] * added),
                 measured=passed.sum() * added.shape[-1] ** 2 / 3),)


@detects('nonstationary_excitation', of='periods')
def modulated_periods(effect, recordings):
    """Detect a level that is modulated slowly, by all lines alike."""
    found = modulation(*recordings.repeats) if recordings.enough_periods else None
    if found is None:
        return None
    p, sizes, period_s = found
    depth = float(np.hypot(*sizes))
    return Detection(
        effect.name, {'depth': min(depth, 0.99), 'period_s': period_s}, max(p, 10 * EXACT),
        f'the level of all lines is modulated by {100 * depth:.2g} % in {period_s:.3g} s',
        basis=partial(_modulated, sizes=sizes, period_s=period_s))


def _modulated(recordings, sizes, period_s):
    """Return the form of a modulated level: power of each group over the mean of all."""
    two = recordings.two
    ends = np.cumsum(two.weights) * two.cut.rows / two.cut.rate_hz
    times = (np.arange(GRID * len(ends)) + 0.5) / GRID * ends[-1] / len(ends)
    # spectra may begin later than the recording
    angle = 2 * np.pi * (recordings.delay_s + times) / period_s
    power = np.square(1 + sizes[0] * np.cos(angle) + sizes[1] * np.sin(angle))
    group = np.searchsorted(ends, times)
    levels = np.bincount(group, power) / np.bincount(group)
    levels /= levels @ two.weights / two.weights.sum()
    return (Form({}, (), levels=levels),)
