"""
What a nominal model is not sure of itself: small errors that are no effect, eq. (116) to (118).

Gains of sensors, stiffness of arrays, single frequencies and the step of an integrator differ a
little between two correct models. Each is a direction in the expected spectrum with a Gaussian
prior; all are fitted beside every candidate, so that a gap within them is no gap.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects.edits import mix, scale_stiffness
from ssi_ros.gap.likelihood import hermitian, real_vectors, white
from ssi_ros.gap.linearise import linearise

STEP = 1e-4             # relative change for a difference quotient
LEAST = 0.05            # of a whitened spectrum: a smaller one is no longer a small correction
MOST = 4.0              # standard deviations that a correction may go


@dataclass(frozen=True, eq=False)
class Tolerance:
    """
    Whitened directions of what is not known exactly, in units of their standard deviations.

    Attributes
    ----------
    names : tuple of str
        What each is.
    vectors : ndarray, shape (n, k l l)
        Change of the whitened spectrum by one standard deviation.

    """

    names: tuple
    vectors: np.ndarray

    def profile(self, seen):
        """
        Return the gain of the log likelihood by the tolerances, eq. (117), and how they stand.

        Parameters
        ----------
        seen : Whitened
            A record as a model sees it.

        Returns
        -------
        gain : float
        most : ndarray, shape (n,)
            Their most probable values; far from the record, as a wrong candidate is, they go
            so far only, for they must neither bend the spectrum nor win by it.
        inverse : ndarray, shape (n, n)
            Of their information with the prior, (F + 1)^-1.

        """
        excess = seen.excess.sum(axis=0)
        slopes = seen.weight * (self.vectors @ excess)
        many = seen.weight * len(seen.excess)
        inverse = np.linalg.inv(many * (self.vectors @ self.vectors.T) + np.eye(len(slopes)))
        most = inverse @ slopes
        share = min(1.0, MOST / max(np.abs(most).max(initial=0.0), 1e-300))
        return float(slopes @ most) * (share - share ** 2 / 2), share * most, inverse

    def corrected(self, model, seen):
        """Return the model with the tolerances at their most probable values, eq. (118)."""
        _, most, _ = self.profile(seen)
        count = model.shape[-1]
        bend = np.eye(count) + hermitian((most @ self.vectors).reshape(-1, count, count))
        if np.linalg.eigvalsh(bend).min() < LEAST:
            return model
        factor = np.linalg.cholesky(model)
        return white(factor, bend[None])


def no_tolerance(frame, channels):
    """Return a tolerance of nothing."""
    return Tolerance((), np.zeros((0, (frame.last - frame.first) * channels ** 2)))


def tolerances(simulator, candidate, levels, settings):
    """
    Return the tolerances around a candidate.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    candidate : Candidate
        Effects that are in the model.
    levels : ndarray
        Of excitation and noise.
    settings : DiagnosisSettings
        The standard deviations.

    Returns
    -------
    Tolerance

    """
    # hinges are made linear once: so small a change of the rest leaves them as they are
    setup = replace(linearise(simulator.setup(candidate, levels)), drift=0.0)
    base = simulator.spectrum(setup).at(levels)
    lower = np.linalg.inv(np.linalg.cholesky(base))
    names, vectors = [], []
    for name, moved, size in _moves(setup, settings):
        if size > 0.0:
            there = simulator.spectrum(moved).at(levels)
            change = real_vectors(white(lower, there - base)).mean(axis=0)
            names.append(name)
            vectors.append(change * (size / STEP))
    if not names:
        return no_tolerance(simulator.frame, base.shape[-1])
    return Tolerance(tuple(names), np.array(vectors))


def _moves(setup, settings):
    """Yield name, setup with the number moved by STEP, and its standard deviation."""
    channels = setup.system.channels
    for i, channel in enumerate(channels):
        matrix = np.eye(len(channels))
        matrix[i, i] += STEP
        yield f'gain of {channel}', mix(setup, matrix), settings.gain_std
    arrays = [a.name for a in setup.spacecraft.arrays]
    for array in arrays:
        yield (f'stiffness of {array}', replace(setup, system=scale_stiffness(
            setup.system, [array], 1 + STEP)), settings.stiffness_std)
    modes = max(a.modes for a in setup.spacecraft.arrays)
    for mode in range(modes):
        factors = {f'{a}_eta{mode + 1}': 1 + 2 * STEP for a in arrays}
        yield (f'frequency of mode {mode + 1}', _scaled(setup, factors), settings.frequency_std)
    # An integrator with a step or a mesh errs by the square of the frequency.
    squares = {d: setup.system.stiffness[i, i] for i, d in enumerate(setup.system.dofs)
               if '_eta' in d}
    top = max(squares.values())
    factors = {d: 1 + 2 * STEP * k / top for d, k in squares.items()}
    yield 'error that grows with frequency', _scaled(setup, factors), settings.dispersion_std


def _scaled(setup, factors):
    """Return the setup with the diagonal stiffness of freedoms multiplied."""
    scale = np.sqrt([factors.get(d, 1.0) for d in setup.system.dofs])
    system = setup.system
    return replace(setup, system=replace(
        system, stiffness=system.stiffness * np.outer(scale, scale),
        damping=system.damping * np.outer(np.sqrt(scale), np.sqrt(scale))))
