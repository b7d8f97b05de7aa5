"""A reference brought to the levels of a record, those of all inputs free, eq. (150a)."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import compare, divergence, floor_of_band
from ssi_ros.gap.nominal.modal.fit import fit, LITTLE, residual_of, STEPS
from ssi_ros.gap.nominal.modal.prediction import Averages
from ssi_ros.gap.nominal.modal.reference import noise_floor, Nominal
from ssi_ros.gap.nominal.modal.score_test import score_forms
from ssi_ros.gap.nominal.modal.starting_values import all_forms, best_forms, bracketed
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.gap.spectra.band_averages import level_of, silent, Spectra
from ssi_ros.hermitian import filtered
from ssi_ros.levels.forces import force_spectra, turning
from ssi_ros.scipy_later import uniform_filter1d
from ssi_ros.tails import chi2

POINTS = 33             # of a band, over which its modes are averaged
TRIED = 4               # effects at one level, that could explain as much as other levels do
NEAREST = 2             # ways of each, as whether it acts on noise as well
REPEATS = 2             # of the estimate of levels
LEVELLED = 3            # of them, beside which levels are estimated
ALIKE = 2.0             # times the median of all channels: so much more noise one may have
SMOOTH = 9              # bands, over which a misfit is averaged
LEAST_KNOWN = 0.5       # share of bands, and of the power of channels, to be explained
EFFECT = 1.0            # standard deviations of a gap, by which an effect must leave less
FAR = 10.0              # standard deviations of a gap, or below its floor: levels mean nothing
PADDING = 0.01          # of the power of a channel: what is below is noise, at another level


@dataclass(frozen=True, eq=False)
class Compared:
    """A reference and a record whose levels need not be equal, ready to be compared."""

    nominal: Nominal
    one: Spectra            # of the reference
    two: Spectra            # of the record
    turn: np.ndarray = None     # (b, l, l), filter by which all levels are equal; None if one does
    notes: tuple = ()

    @property
    def record(self):
        """Return the record as a fit needs it."""
        return Averages(self.two.mean, self.one.freedom, self.two.freedom)

    def in_all_bands(self, mean, cut, level):
        """Return a mean of the reference, (b, l, l), with the levels of inputs of the record."""
        if self.turn is None:
            return mean
        mean = mean.copy()
        mean[np.isin(cut.chosen, self.one.cut.chosen)] = self.one.mean / np.exp(level)
        return mean


def compared(nominal_of, one, two, effects, noisier):
    """
    Return the Spectra of a reference and a record as a `Compared`; levels are no difference.

    `nominal_of` makes a Nominal of the Spectra of the reference, `noisier` the Spectra of both
    with white noise of powers (2, l) in their samples. Where the modes of the reference do not
    explain it, one level is free, and bands in which either hides in noise are left out.
    """
    whole = Compared(nominal_of(one), one, two)
    freed = at_free_levels(whole, effects, noisier)
    if freed:
        return freed
    level, std = level_of(one.mean, two.mean, one.freedom, two.freedom)
    quiet = np.all([silent(p) for s in (one, two) for p in np.einsum('bii->ib', s.mean).real],
                   axis=0)
    if quiet.all() or abs(level) <= LIMITS.other_level.value + LIMITS.clear_level.value * std:
        return whole
    one, two = (_padded(s.in_bands(~quiet)) for s in (one, two))

    def loud(powers):
        return (_padded(s.in_bands(~quiet)) for s in noisier(powers))
    return replace(_at_one_level(Compared(nominal_of(one), one, two), loud), notes=(
        f'the level differs by {10 * level / np.log(10):+.1f} dB; {quiet.sum()} of {len(quiet)} '
        'bands hold noise only, which does not grow with it, and were left out',))


def _with(nominal, spectra):
    """Return a nominal with other Spectra of its recording."""
    return replace(nominal, spectrum=spectra.mean, floor=noise_floor(spectra.mean))


def _padded(spectra):
    """Return spectra with a share of the mean power of each channel added to it."""
    power = PADDING * np.einsum('bii->bi', spectra.mean).real
    return replace(spectra, groups=spectra.groups + power[:, :, None] * np.eye(power.shape[1]))


def missing_noise(nominal, one, two):
    """
    Return the power of noise that a reference and a record have less than the other, (2, l).

    Noise does not grow with the level of the forces. What each channel has more or less of it
    than a level explains is to be made equal, as far as noise that stays could make it so.
    """
    louder = level_of(one.mean, two.mean)[0] > 0.0
    if louder:      # more noise than in the other is always a spectrum, less need not be
        nominal, one, two = _with(nominal, two), two, one
    record, forms = Averages(two.mean, one.freedom, two.freedom), all_forms(
        nominal, ('sensor_noise',))
    fitted = fit(nominal, record, forms)
    if not np.isfinite(fitted.x).all() or not fitted.prediction.possible:
        return np.zeros((2, len(nominal.floor)))
    level = np.exp(fitted.x[0])
    change = level * fitted.x[2:] + fitted.x[1]      # in floors of the channels
    change = np.clip(change, min(0.0, 1 - level), max(0.0, 1 - level))
    # of one channel alone it is an effect
    most = ALIKE * np.median(np.abs(change))
    change = nominal.floor * np.clip(change, -most, most)
    powers = np.maximum([change / level, -change], 0.0)
    return powers[::-1] if louder else powers


def at_free_levels(whole, effects, noisier):
    """
    Return a Compared whose reference is at the levels of the record, each input's on its own.

    It is as it was where that of all is equal and explains the record as well, alone or with one
    effect, and None where the modes of the reference do not explain its spectrum, or where what
    differs is far more than levels.
    """
    nominal, one, two, record = whole.nominal, whole.one, whole.two, whole.record
    cut = one.cut
    half = (cut.band_bins + 1) * cut.resolution_hz / 2
    points = cut.middles_hz[:, None] + np.linspace(-half, half, POINTS)
    forces = force_spectra(nominal.identified, points, nominal.spectrum, one.freedom)
    if forces is None:
        return None
    known = _explained(forces.mean, one)
    power = np.einsum('bii->bi', one.mean).real
    if min(known.mean(), np.mean(power[known].sum(axis=0) / power.sum(axis=0))) < LEAST_KNOWN:
        return None
    whole, full = _in_bands(whole, known), whole
    forces, nominal, one, two, record = (
        forces.in_bands(known), whole.nominal, whole.one, whole.two, whole.record)
    base = fit(nominal, record)
    basis = forces.basis(residual_of(nominal, record, base)[1])

    def enough(found):
        residual = residual_of(nominal, record, found)[0]
        along = float(np.sum((basis @ residual) ** 2))
        across = (residual @ residual - along) / (len(residual) - len(basis))
        return chi2.sf(along / max(across, 1.0), len(basis)) > LIMITS.detected.value

    def gap(fitted, reference=one):
        return compare(reference, two, fitted.prediction, nominal.trust).deviations
    # where the level of all differs, each may have its own: which is no evidence of an effect
    equal = abs(base.x[0]) < LIMITS.other_level.value
    if equal and enough(base):
        return full
    # an effect bends the levels that are estimated without it
    tried = [f for f in _tried(whole, base, all_forms(nominal, effects))
             if np.isfinite(f.likelihood)]
    tried.sort(key=gap)
    if equal and any(gap(f) < LIMITS.inside.value and enough(f) for f in tried):
        return full
    found = [(whole, f) for f in [base] * bool(enough(base)) + tried]
    found += [r for f in (base, *tried[:LEVELLED]) for r in _levelled(whole, f, forces)]
    # what needs no other levels is as simple as levels without an effect; freed ones may leave
    # less than chance does, which makes them no better, and far less is an overfit
    left = [gap(f, r.one) for r, f in found]
    away = [max(g, -FAR - g, 0.0) + EFFECT * (
        bool(f.forms) and not (r is whole and enough(f))) for g, (r, f) in zip(left, found)]
    # far from all of them levels mean nothing, as where modes are elsewhere
    if min(away, default=np.inf) >= FAR:
        return None
    best, fitted = found[int(np.argmin(away))]
    if best is whole:
        return full if equal else _at_one_level(full, noisier)
    return replace(best, nominal=replace(best.nominal, law=_law(forces, whole, base, fitted)))


def _at_one_level(whole, noisier):
    """Return a Compared whose levels differ by one factor, of which noise is no part."""
    one, two = noisier(missing_noise(whole.nominal, whole.one, whole.two))
    return Compared(_with(whole.nominal, one), one, two)


def _law(forces, whole, base, fitted):
    """
    Return the variance of a score beside levels, over that of chance, eq. (150c).

    Where the modes do not quite explain the reference, neither do they explain what other levels
    make of it: to the same share, in a direction in which a test may look.
    """
    misfit, floor = _misfit(forces.mean, whole.one)
    share = 2 / forces.mean.shape[-1] ** 2 * max(np.mean(misfit) - floor, 0.0)
    moved = divergence(base.prediction.mean, fitted.prediction.mean, np.inf, np.inf)
    return float(1 + 2 * share * whole.record.weight * np.sum(whole.nominal.trust * moved))


def _explained(mean, one):
    """Return in which bands a model is as far from the reference as the right one is, (b,)."""
    misfit, floor = _misfit(mean, one)
    return uniform_filter1d(misfit / floor, SMOOTH, mode='nearest') <= LIMITS.usual_scatter.value


def _misfit(mean, one):
    """Return D of a model to the reference in every band, (b,), and its mean by chance."""
    return (divergence(mean, one.mean, np.inf, one.freedom),
            floor_of_band(one.freedom, mean.shape[-1])[0])


def _in_bands(whole, known):
    """Return a Compared in the bands whose levels are known, with a note of the others."""
    if known.all():
        return whole
    one, two = whole.one.in_bands(known), whole.two.in_bands(known)
    nominal = replace(_with(whole.nominal, one), cut=one.cut, trust=whole.nominal.trust[known])
    hz = whole.one.cut.middles_hz[~known]
    return Compared(nominal, one, two, None, (
        f'the level differs; {len(hz)} of {len(known)} bands from {hz[0]:.4g} to {hz[-1]:.4g} Hz, '
        'which the modes of the reference do not explain, were left out',))


def _tried(whole, base, forms):
    """Yield the fits of the effects that promise most at one level."""
    nominal, one, two, record = whole.nominal, whole.one, whole.two, whole.record
    far = compare(one, two, base.prediction, nominal.trust).deviations > LIMITS.far.value
    best = best_forms(score_forms(nominal, base, one, two, forms))[:TRIED] if forms else ()
    for form in best:
        found = [form]
        if len(form.numbers) == 1:
            found = [bracketed(nominal, f, two.mean, one.freedom, two.freedom)
                     for f in (form, *form.variants)]
            found = [f for f, _ in sorted(found, key=lambda f: f[1])[:NEAREST]]
        climbs = far and len(form.numbers) == 1
        for form in found:
            start = np.append([base.x[0], LITTLE] if climbs else base.x, form.start)
            yield fit(nominal, record, (form,), start, STEPS, base.x, climbs)


def _levelled(whole, fitted, forces):
    """Yield Compared by the levels beside a fit, and that fit to each, if both can exist."""
    nominal, record = whole.nominal, whole.record

    def changed(matrices):
        for form in fitted.forms:
            gain = form.change(nominal, fitted.x[2:])[0]
            matrices = filtered(gain if np.ndim(gain) < 4 else gain[:, None], matrices)
        return matrices
    turn = turning(forces.mean, forces.at_levels_of(
        record.mean, record.n_two, np.exp(fitted.x[0]), changed))
    x = np.append(np.zeros(2), fitted.x[2:])
    for _ in range(REPEATS):        # the filter is nearest to none: levels are not quite those
        one = replace(whole.one, groups=filtered(turn, whole.one.groups))
        moved = _with(nominal, one)
        try:
            lower = residual_of(moved, record, replace(fitted, x=x))[1]
        except np.linalg.LinAlgError:       # an effect or less noise that takes away too much
            return
        moved = replace(moved, levels=forces.basis(lower, changed))
        again = fit(moved, record, fitted.forms, x)
        if not again.prediction.possible:
            return
        yield Compared(moved, one, whole.two, turn, whole.notes), again
        turn, x = again.turn @ turn, again.x
