"""Try fitted forms on groups that the fit did not see, eq. (166) and (167)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.meter import closed_share
from ssi_ros.gap.reference.distance import measure
from ssi_ros.gap.reference.extra import NONLINEAR
from ssi_ros.gap.reference.fit import fit, Fitted, predict

REFIT_STEPS = 3
DECADES = 6.0           # nats that the logarithm of an unknown size may lie in
LEAST_SIZE = 0.1        # of a number, in units of where its fit starts
SURE = 30.0             # log odds of a statistic that cannot be chance
EXACT = 1e6             # and of what is read off the samples themselves: no fit outweighs it
MODAL = 0.1             # share of the gap that a modal form may leave
LINEARISED = 0.5        # and the equivalent linear form of a joint that its signs tell
UNKNOWN = 12.0          # log odds that the unknown pays: it fits anything


@dataclass(frozen=True, eq=False)
class Ranked:
    """
    Fitted forms and their trial on held-out groups.

    Attributes
    ----------
    fitted : Fitted
        Of all groups.
    value, floor, floor_std : float
        Held-out gap, mean of the two folds.
    bonus : float
        Log odds of a sign.
    gross : bool
        Whether the gap is so large that distances rank better than slopes.

    """

    fitted: Fitted
    value: float
    floor: float
    floor_std: float
    bonus: float = 0.0
    gross: bool = False

    @property
    def names(self):
        """Names of the effects."""
        return tuple(f.effect for f in self.fitted.forms)

    @property
    def worth(self):
        """Log odds by which candidates are ordered."""
        return worth(self.fitted, self.bonus, self.gross)

    @property
    def tolerance(self):
        """
        Share of the gap that a right candidate may leave: the error of its modal form.

        An equivalent linear form of a joint is Gaussian and the joint is not, nor are pulses, that
        ring where they will; their signs name them.
        """
        by_signs = self.bonus > 0.0 and set(self.names) & {*NONLINEAR, 'impulsive_events'}
        return LINEARISED if by_signs else MODAL

    @property
    def deviations(self):
        """How many standard deviations the held-out gap is above its floor."""
        return (self.value - self.floor) / self.floor_std


def worth(fitted, bonus, gross):
    """Return the log odds of a fit with the signs that speak for it; `gross` as in Ranked."""
    # modes that moved speak once, whichever of two forms moves them
    odds = max((f.odds for f in fitted.forms if f.odds), default=0.0)
    odds += bonus - sum(f.measured for f in fitted.forms) / 2
    return (fitted.far if gross else fitted.likelihood) + odds + occam(fitted)


def occam(fitted):
    """
    Return the log of posterior over prior volume of the numbers of forms and of their places.

    The prior of a size is even in its logarithm over DECADES to both sides, as in eq. (112). Where
    a form has a number for every mode, the modes have a change in common and each its own beside
    it, both of a size that all of them tell.
    """
    total = 0.0
    for k, form in enumerate(fitted.forms):
        at = fitted.coordinates(k)
        if form.numbers:
            start = np.array([n.start for n in form.numbers])
            information = np.linalg.pinv(fitted.covariance[at, at] / np.outer(start, start),
                                         hermitian=True)
            x, weight = fitted.x[at] / start, np.diag(information) / np.trace(information)
            common = x @ weight
            own = np.sqrt((x - common) ** 2 @ weight)
            sizes = (common, own) if len(x) > 1 else (common,)
            prior = max(common ** 2, LEAST_SIZE ** 2) * np.ones((len(x), len(x)))
            prior += own ** 2 * np.eye(len(x))
            inside = np.eye(len(x)) + prior @ information
            total -= 0.5 * float(np.linalg.slogdet(inside)[1])
            total -= 0.5 * float(x @ information @ np.linalg.solve(inside, x))
            total -= len(sizes) * np.log(2 * DECADES / np.sqrt(2 * np.pi))
        total -= np.log(form.places)
    return total


def try_held_out(nominal, one, two, fitted, scatter, bonus=0.0, gross=False):
    """
    Fit every second group anew, and measure on the others; then the other way round.

    Parameters
    ----------
    nominal : Nominal
        The reference.
    one, two : Spectra
        Reference and record.
    fitted : Fitted
        Of all groups.
    scatter : float
        Standard deviation of the floor in the data over that of theory, at least 1.
    bonus : float
        Log odds of a sign.
    gross : bool
        As in Ranked.

    Returns
    -------
    Ranked

    """
    values = []
    for train, test in ((0, 1), (1, 0)):
        first, second = one.only(np.arange(train, len(one), 2)), two.only(
            np.arange(train, len(two), 2))
        half = fit(nominal.with_spectrum(first.mean), second.mean, first.freedom, second.freedom,
                   fitted.forms, fitted.x, REFIT_STEPS)
        first, second = one.only(np.arange(test, len(one), 2)), two.only(
            np.arange(test, len(two), 2))
        prediction = predict(nominal.with_spectrum(first.mean), fitted.forms, half.x)
        if not prediction.possible:
            prediction = fitted.prediction
        gap = measure(first, second, prediction, nominal.trust)
        values.append((gap.value, gap.floor, gap.floor_std))
    value, floor, std = np.mean(values, axis=0)
    return Ranked(fitted, float(value), float(floor),
                  float(std / np.sqrt(2) * scatter), bonus, gross)


def closed(before, after):
    """
    Return the share of the gap that is gone, with its 90 % interval as in (113).

    NaN where the gap before is within three standard deviations of its floor, eq. (167).
    """
    if before.deviations < 3.0:
        return float('nan'), float('nan'), float('nan')
    return closed_share(before.value - before.floor, after.value - after.floor, after.floor,
                        after.floor_std)


def posterior(ranked, nominal, p_value):
    """
    Return probabilities of the candidates, of "none" and of "unknown", which sum to 1.

    "unknown" has the likelihood that the best candidate would have if it left only the floor,
    less what a freedom to fit anything costs; the scores are tempered by the scatter of the data.

    Parameters
    ----------
    ranked : sequence of Ranked
        Candidates, best first.
    nominal : Ranked
        Level and noise alone.
    p_value : float
        Of the test for a gap.

    Returns
    -------
    shares : ndarray, shape (n,)
    none, unknown : float

    """
    best = ranked[0]
    left = max(best.deviations, 0.0) ** 2 / 2
    share = (best.value - best.floor) / max(nominal.value - nominal.floor, 1e-12)
    if nominal.deviations > 3:
        left *= float(np.clip((share - best.tolerance) / 0.3, 0.0, 1.0))
    none = nominal.worth - best.worth + np.log(max(p_value, 1e-300)) * (nominal.deviations < 3)
    logs = np.array([r.worth - best.worth for r in ranked] + [none, left - UNKNOWN])
    weights = np.exp(np.clip(logs - logs.max(), -700, 0))
    weights /= weights.sum()
    return weights[:-2], float(weights[-2]), float(weights[-1])
