"""The inputs of one record: their values, their spectrum, what was predicted of them."""
from dataclasses import dataclass, field, replace

import numpy as np

from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.inputs.expected import expected_beside
from ssi_ros.model.excitation import LEVEL_RATE_HZ, White
from ssi_ros.windows import tapered_dft, unit_taper

PREFIX = 'recorded '    # of the names of excitations that stand for them
SILENT = 1e-12          # of its mean power: an input has at least so much in every bin
SMOOTH_ROWS = 2048      # of the segments behind a smooth spectrum
TAPER_SHARE = 1.0       # of those segments


@dataclass(frozen=True, eq=False)
class RecordedInputs:
    """
    Recorded inputs of a model, row by row with the channels, held until the next row.

    Attributes
    ----------
    names : tuple of str, (m,)
        Inputs of the model.
    values : ndarray, shape (n, m)
        Without gaps and without mean.
    rate_hz : float
        Of the stamps.
    anchor : Setup or None
        The linear setup whose response was taken from the channels; None: nothing was.
    base : ndarray, shape (n, l)
        That response from rest.
    taken : ndarray, shape (n, l)
        The same with what the state before the record rings on: what was taken.
    exact : bool
        Whether changes of the response count by their square as well; else to first order.
    first : bool
        Whether the inputs come first among the channels, given and complete.
    shown : bool
        Whether they are among the channels at all.

    """

    names: tuple
    values: np.ndarray
    rate_hz: float
    anchor: object = None
    base: np.ndarray = 0.0
    taken: np.ndarray = 0.0
    exact: bool = True
    first: bool = True
    shown: bool = True
    known: dict = field(default_factory=dict)       # spectra and transfers by frame, kept

    @property
    def count(self):
        """Return the number of inputs m."""
        return len(self.names)

    def expected(self, setup, frame, jitter_noise=None):
        """Return the Expected of a steady setup beside the inputs; see `expected_beside`."""
        return expected_beside(setup, frame, self)

    def moving(self, model):
        """Return a LinearModel that random inputs of the same power move; others as they are."""
        if not hasattr(model, 'drives'):
            return model
        level = dict(zip(self.names, self.values.std(axis=0)))
        return replace(model, drives=tuple(
            replace(d, level=float(level.get(d.name, d.level))) for d in model.drives))

    def spectrum(self, frame):
        """
        Return the spectral matrix of the inputs in the bins of a frame, (k, m, m).

        In the segments of the record it is the mean of their periodograms, so that what the
        inputs did is no evidence at all; in another frame a smooth one.
        """
        key = frame.rows, frame.begins, frame.first, frame.last
        if key not in self.known:
            whole = frame.segments > 1 and frame.begins[-1] + frame.rows <= len(self.values)
            found = _mean_periodogram(self.values, frame.taper, frame.begins)[
                frame.first:frame.last] if whole else self._smooth(frame)
            power = np.einsum('kii->i', found).real / len(found)
            self.known[key] = found + SILENT * np.diag(np.maximum(power, 1e-300))
        return self.known[key]

    def _smooth(self, frame):
        """Return the mean spectrum of short segments at the bins of a frame, (k, m, m)."""
        rows = min(SMOOTH_ROWS, len(self.values) // 4) // 2 * 2
        begins = tuple(range(0, len(self.values) - rows + 1, rows // 2))
        found = _mean_periodogram(self.values, unit_taper(rows, TAPER_SHARE), begins)
        at = np.minimum(frame.frequencies_hz / frame.rate_hz * rows, rows // 2 - 1e-9)
        low, share = at.astype(int), (at % 1.0)[:, None, None]
        return (1 - share) * found[low] + share * found[low + 1]

    def linear(self, setup):
        """
        Return a setup with its hinge laws linearised at the motion that the inputs make.

        And the names of the excitations that stand for the inputs in it, now silent.
        """
        if not setup.laws:
            return setup, ()
        system, stds = setup.system, self._levels(setup.system)
        parts = tuple(White(PREFIX + n, (n,), (float(s),)) for n, s in zip(self.names, stds))
        found = linearise(replace(setup, system=replace(
            system, excitation=system.excitation + parts)))
        names = tuple(p.name for p in parts)
        silent = tuple(replace(p, rms=(0.0,)) if p.name in names and isinstance(p, White) else p
                       for p in found.system.excitation)
        return replace(found, system=replace(found.system, excitation=silent)), names

    def _levels(self, system):
        """Return the rms of white inputs that move the channels as much as these, (m,)."""
        rows = min(SMOOTH_ROWS, len(self.values) // 4) // 2 * 2
        begins = tuple(range(0, len(self.values) - rows + 1, rows // 2))
        power = _mean_periodogram(self.values, unit_taper(rows, TAPER_SHARE), begins)[1:-1]
        frequencies_hz = np.arange(1, rows // 2) * self.rate_hz / rows
        columns = [system.inputs.index(n) for n in self.names]
        gain = np.sum(np.abs(system.transfer(
            frequencies_hz, system.rate_hz)[:, :, columns]) ** 2, axis=1)
        mean = np.einsum('km,kmm->m', gain, power).real / np.maximum(gain.sum(axis=0), 1e-300)
        return np.sqrt(mean * LEVEL_RATE_HZ / system.rate_hz)


def _mean_periodogram(values, taper, begins):
    """Return the mean of U U^H over segments at all bins, (rows // 2 + 1, m, m)."""
    found = tapered_dft(values, taper, begins)
    return np.einsum('ski,skj->kij', found, found.conj()) / len(begins)
