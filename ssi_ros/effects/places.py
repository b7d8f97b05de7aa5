"""Where an effect can act on a model, and which effects a model cannot have."""
from itertools import product

import numpy as np

from ssi_ros.effects.base import Site
from ssi_ros.effects.library import effect_class, library
from ssi_ros.model.excitation import source
from ssi_ros.model.structure import default_excitation

GROUND = 'ground'       # what does not move
MOST_PAIRS = 60         # of points that are joined: the most strongly joined ones
JOINED = 1e-6           # of the geometric mean of two diagonal entries: less joins nothing
DIRECTIONS = 'x', 'y', 'z'      # of a point, the last letter of its name
OFFERED = ('geometry', 'arrays')     # by a spacecraft
WORDS = {'geometry': 'arrays, places on them or a hub', 'arrays': 'two arrays',
         'modes': 'a model of matrices', 'points': 'points that springs can join'}


def offered(model):
    """Return what a model offers to effects; a Spacecraft has a geometry, None is a recording."""
    there = getattr(model, 'offers', OFFERED)
    # of one array there is no other that it could differ from
    return OFFERED[:1] if there is OFFERED and model and len(model.arrays) < 2 else there


def applicable(model, names=None):
    """
    Return the names of the effects that a model can have, in the order of the library.

    Parameters
    ----------
    model : Spacecraft, LinearModel or None
        What effects are injected into; None for a recording.
    names : sequence of str, optional
        The only ones to consider.

    Raises
    ------
    ValueError
        If one of `names` is not known, or needs what the model does not have.

    """
    if names:
        classes = tuple(map(effect_class, names))
        check_needs(model, classes)
        return tuple(cls.name for cls in classes)
    there = set(offered(model))
    return tuple(n for n, cls in library().items()
                 if set(cls.needed()) <= there and not cls.law_of)


def check_needs(model, classes):
    """Raise ValueError where an effect of some classes needs what a model does not have."""
    there = offered(model)
    for cls in classes:
        lacking = [n for n in cls.needed() if n not in there]
        if lacking:
            raise ValueError(f'{cls.name} needs {WORDS[lacking[0]]}, which this model does not '
                             'have; leave it out')


def left_out(model):
    """Return a sentence on the effects that need the geometry of a spacecraft, or nothing."""
    if 'geometry' in offered(model):
        return ()
    names = [n for n, cls in library().items() if 'geometry' in cls.needed()]
    return (f'The model has no geometry, so that {len(names)} effects were left out: '
            + ', '.join(names) + '.',)


def places(cls, model):
    """Yield the words of an effect for every place on a model, as dicts."""
    words = cls.words()
    if {'freedom', 'to'} <= {f.name for f in words}:
        from ssi_ros.effects.points import held_pairs
        # friction and play bind what would drift apart without a spring
        yield from ({'freedom': a, 'to': b}
                    for a, b in (held_pairs if cls.nonlinear else pairs)(model))
        return
    found = list(product(*(_choices(cls, f, model) for f in words)))
    for choice in found:
        if len(choice) < 2 or choice[0] != choice[1]:
            yield dict(zip([f.name for f in words], choice))


def _choices(cls, f, model):
    """Return what a word of an effect may name."""
    if f.name == 'array':
        return [a.name for a in model.arrays]
    if f.name == 'mode':
        return [str(i + 1) for i in range(model.vibrating)]
    if f.name == 'freedom':
        # a force that has a level already is no other one
        from ssi_ros.effects.points import undriven
        points = undriven(model) if cls.site is Site.EXCITATION else list(model.points)
        return points + nodes(points) * cls.nodes
    if f.name == 'force':
        names = levels_of(model)
        all_but_one = ['+'.join(n for n in names if n != left) for left in names]
        return ['all', *names * (len(names) > 1), *all_but_one * (len(names) > 2)]
    return (['all'] if f.default == 'all' else []) + [s.name for s in model.sensors]


def nodes(points):
    """Return the points that are one node in several directions, by their last letters, with +."""
    found = {}
    for point in points:
        if point[-1:].lower() in DIRECTIONS and point[:-1]:
            found.setdefault(point[:-1], []).append(point)
    return ['+'.join(each) for each in found.values() if len(each) > 1]


def levels_of(model):
    """Return the names of what is random in the excitation and has a level of its own."""
    if hasattr(model, 'level_names'):
        return model.level_names
    return [p.name for p in default_excitation(model) if any(source(p).rms)]


def pairs(model):
    """Return the pairs of points that springs of a model join, and every point with the ground."""
    found = {(p, GROUND): np.inf for p in model.points}
    joined = model.freedoms if model.physical else model.points
    for i, j in zip(*np.triu_indices(len(joined), 1)):
        strength = _strength(model, i, j)
        if strength > JOINED:
            found[joined[i], joined[j]] = strength
    kept = sorted(found, key=lambda pair: -found[pair])[:MOST_PAIRS]
    return [pair for pair in found if pair in kept]


def _strength(model, i, j):
    """Return how strongly stiffness or damping joins two points; 1 for channels of modes."""
    if not model.physical:
        return 1.0
    return max(abs(m[i, j]) / max(np.sqrt(abs(m[i, i] * m[j, j])), 1e-300)
               for m in (model.stiffness, model.damping))
