"""What a record can tell before it exists: sizes seen, effects alike; eq. (114) and (115)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.effects import library
from ssi_ros.gap.candidate import Candidate, starting_points
from ssi_ros.gap.fit import Simulator
from ssi_ros.gap.scores import make_templates
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import make_frame


@dataclass(frozen=True)
class Visible:
    """
    How well an effect at one place and size can be seen.

    Attributes
    ----------
    effect : Effect
        At the starting value that was probed.
    detection : float
        d', the mean of its score in standard deviations; about 4 is a sure detection.
    alike : tuple of (str, float)
        Effects with the largest cosines of their scores, largest first.

    """

    effect: object
    detection: float
    alike: tuple


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
        Pieces and band.
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
    frame = make_frame(round(duration_s * spacecraft.rate_hz), spacecraft.rate_hz, settings)
    simulator = Simulator(spacecraft, frame, duration_s)
    plain = simulator.expected(Candidate())
    templates = make_templates(
        simulator, plain.at(np.ones(len(plain.names))), plain.shares,
        starting_points(library().values(), spacecraft), progress)
    information = np.einsum('tk,tk->t', templates.mean, templates.mean) * frame.pieces
    for i, swing in templates.swing.items():
        information[i] += np.sum(swing ** 2)
    size = np.sqrt(np.maximum(information, 1e-30))
    product = frame.pieces * (templates.mean @ templates.mean.T).astype(float)
    for i, swing in templates.swing.items():
        for j, other in templates.swing.items():
            product[i, j] += np.sum(swing * other)
    cosine = product / np.outer(size, size)
    detection = size / np.sqrt(frame.crowding)
    groups = {}
    for i, e in enumerate(templates.effects):
        groups.setdefault((e.name, *(getattr(e, f.name) for f in e.words())), []).append(i)
    names = np.array([e.name for e in templates.effects])
    found = []
    for (name, *_), rows in groups.items():
        best = max(rows, key=lambda i: detection[i])
        # an effect is as much alike as its most alike starting value
        likeness = np.abs(cosine[rows]).max(axis=0)
        near = {n: float(likeness[names == n].max()) for n in set(names) if n != name}
        closest = sorted(near.items(), key=lambda pair: -pair[1])[:3]
        found.append(Visible(templates.effects[best], float(detection[best]), tuple(closest)))
    return tuple(found)
