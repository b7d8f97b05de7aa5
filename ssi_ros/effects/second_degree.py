"""Changes of a spectrum by effects that make it a polynomial of second degree in their size."""
from ssi_ros.effects.sizes import change_of


class SecondDegree:
    """
    Changes that follow from the two last ones of the same effect at the same place.

    A gain of 0.6 % on one of two channels that show nearly the same changes what differs between
    them by its square; its change is not three times that by 0.2 %.
    """

    def __init__(self):
        self._kind, self._known = None, []      # changes of one kind at a time: they are large

    def change(self, effect):
        """Return the change by an effect, an array, or None if fewer than two others are known."""
        if effect.kind() != self._kind or len(self._known) < 2:
            return None
        (a, of_a), (b, of_b) = self._known
        s = change_of(effect)
        return s * (s - b) / (a * (a - b)) * of_a + s * (s - a) / (b * (b - a)) * of_b

    def keep(self, effect, change):
        """Keep the change by an effect, if others follow from it; forget those of other kinds."""
        if effect.second_degree:
            if effect.kind() != self._kind:
                self._kind, self._known = effect.kind(), []
            if len(self._known) < 2 and change_of(effect) not in [size for size, _ in self._known]:
                self._known.append((change_of(effect), change))
