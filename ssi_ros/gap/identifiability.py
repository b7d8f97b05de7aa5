"""What a record can tell before it exists: sizes seen, effects alike; eq. (114) and (115)."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import library
from ssi_ros.gap.candidate import Candidate, places, starting_points
from ssi_ros.gap.conclude import separate_by
from ssi_ros.gap.fit import Simulator
from ssi_ros.gap.scores import make_templates, promise
from ssi_ros.gap.search import at_size
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import make_frame, whole_frame
from ssi_ros.gap.tolerance import tolerances
from ssi_ros.gap.torque import EDGE_S, torque_filter

SEEN = 4.0              # d' of the size that counts as seen


@dataclass(frozen=True)
class Visible:
    """
    How well an effect at one place can be seen.

    Attributes
    ----------
    effect : Effect
        At the starting value that was probed.
    detection : float
        d', the mean of its score in standard deviations; NaN for signs of the samples (steps,
        rails, losses), which show at any size.
    seen : Effect or None
        At the size of d' = 4, as far as a straight line leads there.
    alike : tuple of (str, float)
        Effects with the largest cosines of their scores, largest first.
    separate_by : tuple of str
        What would part it from those that are tied with it.

    """

    effect: object
    detection: float
    seen: object
    alike: tuple
    separate_by: tuple = ()


def identifiability(spacecraft, duration_s, settings=DiagnosisSettings(), progress=None):
    """
    Compute which effects a record would show, and which it could not tell apart.

    Parameters
    ----------
    spacecraft : Spacecraft
        The model.
    duration_s : float
        Length of the record [s].
    settings : DiagnosisSettings
        Pieces, band, tolerances.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    tuple of Visible
        One an effect and place: its most visible starting value, in the order of the library.

    Raises
    ------
    ValueError
        If so short a record cannot be cut, with the length needed.

    """
    rows = round(duration_s * spacecraft.rate_hz)
    frame = make_frame(rows, spacecraft.rate_hz, settings)
    simulator = Simulator(spacecraft, frame, duration_s)
    templates = make_templates(simulator, starting_points(library().values(), spacecraft),
                               progress)
    nominal = simulator.expected(Candidate())
    tolerance = tolerances(simulator, Candidate(), np.ones(len(nominal.names)), settings)
    detection, cosine = promise(templates, nominal, frame, tolerance)
    groups = {}
    for i, e in enumerate(templates.effects):
        groups.setdefault((e.name, *(getattr(e, f.name) for f in e.words())), []).append(i)
    names = np.array([e.name for e in templates.effects])
    found = {}
    for (name, *_), members in groups.items():
        best = max(members, key=lambda i: detection[i])
        # an effect is as much alike as its most alike starting value
        likeness = np.abs(cosine[members]).max(axis=0)
        near = {str(n): float(likeness[names == n].max()) for n in set(names) if n != name}
        closest = sorted(near.items(), key=lambda pair: -pair[1])[:3]
        tied = [n for n, c in closest if c > settings.tie_cosine]
        effect = templates.effects[best]
        found.setdefault(name, []).append(Visible(
            effect, float(detection[best]),
            at_size(effect, SEEN / max(detection[best], 1e-9)), tuple((n, c) for n, c in closest),
            separate_by([name, *tied])))
    return tuple(v for cls in library().values()
                 for v in found.get(cls.name) or _by_signs(cls, simulator, rows, settings))


def classes(found, limit):
    """
    Return the classes of effects that cannot be told apart, each with what would part them.

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


def _by_signs(cls, simulator, rows, settings):
    """Return what the torque or the samples would show of an effect without a template."""
    spacecraft = simulator.spacecraft
    words = next(places(cls, spacecraft), {}) if cls.words() else {}
    effect = cls(**words, **{k: v[len(v) // 2] for k, v in cls.starts.items()})
    detection = float('nan')
    if cls.name in ('harmonic_disturbance', 'wheel_speed_sweep', 'impulsive_events'):
        frame = whole_frame(rows, spacecraft.rate_hz, settings, EDGE_S, np.ones(rows, bool))
        levels = np.ones(len(simulator.expected(Candidate()).names))
        gain = torque_filter(simulator, simulator.setup(Candidate()), levels, frame)[1]
        if cls.name == 'impulsive_events':
            # of one pulse; the number of pulses adds to it
            detection = effect.impulse_n_m_s * spacecraft.rate_hz * np.sqrt(
                2 * np.sum(gain ** 2)) * frame.taper.max()
        else:
            low, high = ((effect.frequency_hz,) * 2 if cls.name == 'harmonic_disturbance'
                         else sorted((effect.start_hz, effect.end_hz)))
            at = np.interp(np.linspace(low, high, 200), frame.frequencies_hz, gain ** 2).mean()
            detection = effect.torque_n_m * np.sqrt(at / 2) * np.sum(frame.taper)
    elif cls.name == 'nonstationary_excitation':
        detection = effect.depth * np.sqrt(rows * len(simulator.spacecraft.sensors))
    seen = None
    if np.isfinite(detection):
        seen = replace(effect, **{cls.size: getattr(effect, cls.size) * SEEN / detection})
    return [Visible(effect, float(detection), seen, ())]
