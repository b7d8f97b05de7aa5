"""Changes of a spectrum by effects that make it a polynomial of second degree in their size."""


class SecondDegree:
    """
    Changes that follow from two others of the same effect at the same place.

    A gain of 0.6 % on one of two channels that show nearly the same changes what differs between
    them by its square; its change is not three times that by 0.2 %.
    """

    def __init__(self):
        self._known = {}

    def change(self, effect):
        """Return the change by an effect, an array, or None if fewer than two others are known."""
        known = self._known.get(effect.kind(), ())
        if len(known) < 2:
            return None
        (a, of_a), (b, of_b) = known
        s = _size(effect)
        return s * (s - b) / (a * (a - b)) * of_a + s * (s - a) / (b * (b - a)) * of_b

    def keep(self, effect, change):
        """Keep the change by an effect, if others follow from it."""
        if effect.second_degree:
            known = self._known.setdefault(effect.kind(), [])
            if len(known) < 2 and _size(effect) not in [size for size, _ in known]:
                known.append((_size(effect), change))


def _size(effect):
    return getattr(effect, effect.size) - effect.size_quantity().default
