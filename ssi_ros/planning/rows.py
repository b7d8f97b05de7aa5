"""What a record would show as rows to read: mirrored places together, and who looks like whom."""
from dataclasses import dataclass

import numpy as np

CLOSE = 0.03            # relative difference of numbers, and of cosines, that read as the same
PLACES = 4              # that are named in a row


@dataclass(frozen=True)
class Row:
    """
    One effect at places where a record shows it equally well.

    Attributes
    ----------
    name, where, probed, seen : str
        Effect, places, size that was probed, size at d' = 4; '' where there is none.
    detection, exact, without : float
        As in `Visible`; NaN where the samples show it at any size.
    alike : tuple of (str, float)
        Name and cosine of the nearest effects.

    """

    name: str
    where: str
    probed: str
    seen: str
    detection: float
    exact: float
    without: float
    alike: tuple


def rows_of(found):
    """Return the Rows of what `identifiability` found, in its order."""
    groups = []
    for v in found:
        same = next((g for g in groups if _mirrored(g[0], v)), None)
        if same is None:
            groups.append([v])
        else:
            same.append(v)
    return tuple(_row(g) for g in groups)


def _mirrored(one, other):
    """Return whether two Visibles are one effect at places that a record shows equally well."""
    if one.effect.name != other.effect.name or not one.effect.words():
        return False

    def numbers(v):
        return [abs(getattr(e, f.name)) for e in (v.effect, v.seen) if e is not None
                for f in e.numbers()] + [v.detection, v.exact, v.without]
    a, b = numbers(one), numbers(other)
    return (len(a) == len(b) and np.allclose(a, b, rtol=CLOSE, equal_nan=True)
            and [n for n, _ in one.alike] == [n for n, _ in other.alike]
            and np.allclose([c for _, c in one.alike], [c for _, c in other.alike], atol=CLOSE))


def _row(group):
    first = group[0]
    places = ['/'.join(str(getattr(v.effect, f.name)) for f in v.effect.words()) for v in group]
    more = len(places) - PLACES
    where = ', '.join(places[:PLACES]) + (f' and {more} more' if more > 0 else '')
    size = first.effect.size
    seen = 'any size' if first.seen is None else f'{size} {getattr(first.seen, size):.4g}'
    probed = f'{size} {getattr(first.effect, size):.4g}'
    return Row(first.effect.name, where, probed, seen, first.detection, first.exact,
               first.without, first.alike)


def cosines(found):
    """
    Return names of effects, (n,), and how much their scores are alike, (n, n), 1 for the same.

    Of two effects it is the largest cosine over places and starting values; effects that show in
    the samples alone have no scores and are left out.
    """
    names = list(dict.fromkeys(v.effect.name for v in found if v.near))
    matrix = np.eye(len(names))
    for v in found:
        for name, cosine in v.near:
            if name in names:
                i, j = names.index(v.effect.name), names.index(name)
                matrix[i, j] = matrix[j, i] = max(matrix[i, j], cosine)
    return tuple(names), matrix
