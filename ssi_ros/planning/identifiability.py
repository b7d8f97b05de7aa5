"""What a record can show before it exists: sizes detected, effects alike; eq. (114), (115)."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import applicable, library, places
from ssi_ros.effects.likeness import separate_by
from ssi_ros.effects.registry import deflections
from ssi_ros.effects.sizes import at_size
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors.input_reconstruction import sensitivity
from ssi_ros.gap.inference.score_test import make_templates, promise
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.inputs.beside import acting, to_be_recorded
from ssi_ros.template_cache import effect_templates
from ssi_ros.updating.adapt import standing
from ssi_ros.updating.correlation import heights_of
from ssi_ros.updating.model_uncertainty import model_uncertainty
from ssi_ros.updating.prior import error_directions, prior_of

DETECTED = 4.0          # d' of the size that counts as detected


@dataclass(frozen=True)
class Visible:
    """How well an effect at one place can be detected."""

    effect: object              # at the starting value that was probed
    detection: float            # d', mean of its score in standard deviations; NaN for rounding,
    #                             clipping and losses, which the samples show at any size
    exact: float                # the same if all numbers of the model were exact
    seen: object                # the effect at the size of d' = 4, linearly; None with d' of NaN
    alike: tuple                # (name, cosine of the scores) of the nearest effects
    separate_by: tuple = ()     # what would distinguish it from those that are tied with it
    without: float = float('nan')       # d' where no input is recorded, to first order in the size
    near: tuple = ()            # (name, cosine of the scores) of all other effects


def identifiability(spacecraft, duration_s, settings=DiagnosisSettings(), progress=None, *,
                    inputs=()):
    """
    Compute which effects a record would show, and which it could not distinguish.

    Parameters
    ----------
    spacecraft : Spacecraft or LinearModel
        The model.
    duration_s : float
        Length of the record [s].
    settings : DiagnosisSettings
        Segments, band, small uncertainty of any model; what the model declares, or a calibration
        has left unknown, counts as well.
    progress : callable, optional
        Called with the share done, 0 to 1.
    inputs : sequence of str
        Inputs of the model that will be recorded, at the levels and colours that it gives them.

    Returns
    -------
    tuple of Visible
        One an effect and place: its most visible starting value, in the order of the library.

    Raises
    ------
    ValueError
        If so short a record cannot be cut, with the length needed, or an input has no level.

    """
    settings = getattr(spacecraft, 'cut', lambda usual: usual)(settings)
    rows = round(duration_s * spacecraft.rate_hz)
    frame = make_frame(rows, spacecraft.rate_hz, settings)
    plain = simulator = Simulator(spacecraft, frame, duration_s)
    if inputs:
        simulator = to_be_recorded(simulator, inputs, rows)
    names = acting(applicable(spacecraft), simulator)
    known = [library()[n] for n in names]
    promised = _promising(simulator, settings)
    templates, exact, detection, cosine = promised(
        lambda side: effect_templates(side, settings, names, progress))
    groups = {}
    for i, e in enumerate(templates.effects):
        if not e.law_of:        # another law counts for its effect beside others
            groups.setdefault((e.name, *(getattr(e, f.name) for f in e.words())), []).append(i)
    names = np.array([e.answer for e in templates.effects])
    found = {}
    for (name, *_), members in groups.items():
        # derivatives by a size and by its opposite differ by rounding alone
        best = max(members, key=lambda i: (float(f'{detection[i]:.5g}'), exact[i]))
        # an effect is as much alike as its most alike starting value
        likeness = np.abs(cosine[members]).max(axis=0)
        near = {str(n): float(likeness[names == n].max()) for n in dict.fromkeys(names)
                if n != name}
        closest = sorted(near.items(), key=lambda pair: -round(pair[1], 3))[:3]
        tied = [n for n, c in closest if c > settings.tie_cosine]
        effect = templates.effects[best]
        found.setdefault(name, []).append(Visible(
            effect, float(detection[best]), float(exact[best]),
            at_size(effect, DETECTED / max(detection[best], 1e-9)), tuple(closest),
            separate_by([name, *tied]), near=tuple(near.items())))
    found = tuple(v for cls in known
                  for v in found.get(cls.name) or _by_detection(
                      cls, simulator.but(recorded=None), rows, settings))
    return _beside_none(found, promised, plain, rows, settings) if inputs else found


def _beside_none(found, promised, without, rows, settings):
    """Return what is visible, `promised` beside inputs, with d' of the same effects `without`."""
    # of small sizes both: a large change of a resonance saturates beside inputs, and what errors
    # of a model do not take up of it, without them, is its square
    small = {at_size(v.effect, min(v.effect.first_order, DETECTED / max(v.detection, 1e-9))):
             v.effect for v in found if v.effect.spectral}

    def first_order(promised):
        templates, _, d_prime, _ = promised(lambda side: make_templates(side, list(small)))
        return {small[e]: float(d) for e, d in zip(templates.effects, d_prime)}
    of, other = map(first_order, (promised, _promising(without, settings)))
    d_prime = {v.effect: v.detection * other[v.effect] / max(of[v.effect], 1e-12)
               for v in found if v.effect in of.keys() & other.keys()}
    predicted, levels = deflections(), np.ones(len(without.expected(Candidate()).names))
    for name in {v.effect.name for v in found} & set(predicted):
        at = sensitivity(without, without.setup(Candidate()), levels, rows, settings)
        d_prime |= {v.effect: float(predicted[name](v.effect, at)) for v in found
                    if v.effect.name == name and v.effect not in d_prime}
    return tuple(replace(v, without=d_prime.get(v.effect, v.without)) for v in found)


def _promising(simulator, settings):
    """Return a function from what makes templates to them, d' if exact, d', and cosines."""
    nominal = simulator.expected(Candidate())
    levels, prior = np.ones(len(nominal.names)), prior_of(simulator.spacecraft)
    small = model_uncertainty(simulator, Candidate(), levels, settings)
    if prior is not None:
        moving = standing(simulator, prior)
        unknown = small.and_of(error_directions(moving, levels, prior)).and_of(
            heights_of(moving, Candidate(), levels, len(prior.names)))

    def promised(templates_of):
        templates = templates_of(simulator.for_templates(levels))
        exact, cosine = promise(templates, nominal, simulator.frame, small)
        if prior is None:
            return templates, exact, exact, cosine
        linear, _ = promise(templates, nominal, simulator.frame, unknown)
        templates = templates_of(moving.for_templates(levels))
        moved, cosine = promise(templates, nominal, simulator.frame, unknown)
        # errors imitate an effect by linear changes or by moving modes back: the better of the two
        return templates, exact, np.minimum(exact, np.minimum(linear, moved)), cosine
    return promised


def classes(found, limit):
    """
    Return the classes of effects that cannot be distinguished, each with what would do so.

    Effects belong together if a chain of cosines above `limit` joins them.
    """
    groups = []
    for v in found:
        linked = {v.effect.name, *(n for n, c in v.alike if c > limit)}
        apart = [g for g in groups if not g & linked]
        groups = apart + [linked.union(*(g for g in groups if g & linked))]
    order = list(library())
    named = [tuple(sorted(g, key=order.index)) for g in groups if len(g) > 1]
    return tuple((g, separate_by(g)) for g in sorted(named))


def _by_detection(cls, simulator, rows, settings):
    """Return what a detector would show of an effect without a template."""
    words = next(places(cls, simulator.spacecraft), {}) if cls.words() else {}
    starts = cls.starts_on(simulator.spacecraft, words)
    effect = cls(**words, **{k: v[len(v) // 2] for k, v in starts.items()})
    if cls.name not in (predicted := deflections()):
        return [Visible(effect, float('nan'), float('nan'), None, ())]
    levels = np.ones(len(simulator.expected(Candidate()).names))
    d_prime = float(predicted[cls.name](effect, sensitivity(
        simulator, simulator.setup(Candidate()), levels, rows, settings)))
    size = getattr(effect, cls.size) * DETECTED / d_prime
    return [Visible(effect, d_prime, d_prime, replace(effect, **{cls.size: size}), ())]
