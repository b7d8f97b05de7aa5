"""
Errors of the modes of a model that somebody else has made, eq. (160) to (163) without geometry.

With the modes Phi of (M, K), of mass 1 and frequencies w, errors act on w, on the modal damping,
on what each input does to each mode and on what each channel shows of it: K' = K + M Phi
diag(w'^2 - w^2) Phi^T M, and the other matrices alike. Modes are numbered by rising frequency;
those of a rigid body are not counted.
"""
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from ssi_ros.model.errors import DAMPING, FREQUENCY, GAIN, Numbers, PARTICIPATION, SHAPE
from ssi_ros.model.sensors import Mix
from ssi_ros.model.system import RIGID
from ssi_ros.quantity import unknown

# largest standard deviation that is one of a model, as of a spacecraft's `uncertainty:`
SHARED = 0.5            # of what moves two modes: what turns them into each other, mostly
MOST = {FREQUENCY: 0.5, DAMPING: 3.0, PARTICIPATION: 1.0, SHAPE: 1.0, GAIN: 0.5}


@dataclass(frozen=True)
class ModalUncertainty:
    """
    Standard deviations of the numbers of a LinearModel, each error independent of all others.

    Attributes
    ----------
    frequency : tuple of float, (n,)
        Relative, of the natural frequency of each of the n modes that vibrate.
    damping : tuple of float, (n,)
        Of the logarithm of each damping ratio.
    participation : tuple of tuples, (n, m)
        Relative, of what each input does to each mode.
    shape : tuple of tuples, (l, n)
        Relative, of what each channel shows of each mode.
    gain : tuple of float, (l,)
        Relative, of the gain of each channel.

    """

    frequency: tuple
    damping: tuple
    participation: tuple
    shape: tuple
    gain: tuple

    @property
    def exact(self):
        """Whether nothing is declared uncertain."""
        return not any(np.any(getattr(self, kind)) for kind in MOST)

    def of_channels(self, kept):
        """Return what is known of some channels alone, by their numbers."""
        return replace(self, shape=tuple(self.shape[i] for i in kept),
                       gain=tuple(self.gain[i] for i in kept))


def modal_uncertainty(model, **given):
    """
    Return the ModalUncertainty of a LinearModel.

    Parameters
    ----------
    model : LinearModel
        Whose modes, inputs and channels are meant.
    given : float or array
        `frequency`, `damping` (one number, or one for each mode), `participation` (one, one for
        each mode, or modes x inputs), `shape` (one, one for each mode, or channels x modes),
        `gain` (one, or one for each channel); what is left out is exact.

    Raises
    ------
    ValueError
        For another size, or a deviation that is negative, not finite or beyond MOST.

    """
    n, m, count = model.vibrating, len(model.drives), len(model.sensors)
    sizes = {FREQUENCY: (n,), DAMPING: (n,), PARTICIPATION: (n, m), SHAPE: (count, n),
             GAIN: (count,)}
    found = {}
    for kind, size in sizes.items():
        values = np.squeeze(np.asarray(given.pop(kind, 0.0), dtype=float))
        if kind == PARTICIPATION and values.shape == (n,) and (n, m) != values.shape:
            values = values[:, None]
        try:
            values = np.broadcast_to(values.reshape(size) if values.size == np.prod(size)
                                     else values, size)
        except ValueError:
            raise ValueError(f'uncertainty_{kind} has the shape {values.shape}; give one number, '
                             f'or {" x ".join(map(str, size))} for {_WHAT[kind]}') from None
        wrong = values[~((values >= 0.0) & (values <= MOST[kind]))]
        if wrong.size:
            raise ValueError(f'uncertainty_{kind} holds {wrong[0]:g}; a standard deviation must '
                             f'be 0 to {MOST[kind]:g}')
        found[kind] = tuple(map(tuple, values.tolist())) if len(size) == 2 else tuple(
            values.tolist())
    for name in given:
        raise ValueError(unknown(f'uncertainty_{name}', name, sorted(sizes)) + '; hub_inertia and '
                         'sensor_place_m need the geometry of a spacecraft')
    return ModalUncertainty(**found)


_WHAT = {FREQUENCY: 'the modes that vibrate', DAMPING: 'the modes that vibrate',
         PARTICIPATION: 'modes x inputs', SHAPE: 'channels x modes', GAIN: 'the channels'}


def of_close_modes(model):
    """
    Return the ModalUncertainty of a LinearModel, of close modes not below what follows.

    What moves frequencies by a share turns two modes into each other by that over their distance,
    eps = phi_i^T (dK - w_j^2 dM) phi_j / (w_i^2 - w_j^2): a shape or a participation that is known
    better than that does not go with such frequencies. Source: Fox and Kapoor, AIAA Journal 6(12),
    1968.
    """
    given = model.uncertainty
    if not np.any(given.frequency):
        return given
    shapes, squares = basis_of(model)
    shapes, squares = (x[..., len(squares) - model.vibrating:] for x in (shapes, squares))
    stds = np.array(given.frequency)
    moved = np.hypot.outer(stds, stds) / np.sqrt(2) * np.sqrt(np.outer(squares, squares))
    apart = np.abs(np.subtract.outer(squares, squares))
    np.fill_diagonal(apart, np.inf)
    turns = np.minimum(2 * SHARED * moved / np.maximum(apart, 1e-300), 1.0)
    return replace(given, shape=_at_least(given.shape, model.output @ shapes, turns, SHAPE),
                   participation=tuple(zip(*_at_least(
                       np.transpose(given.participation), (shapes.T @ model.input).T, turns,
                       PARTICIPATION))))


def _at_least(stds, sizes, turns, kind):
    """Return deviations (q, n) of sizes (q, n), no less than modes that turn make of them."""
    turned = np.sqrt(sizes ** 2 @ turns.T ** 2)
    share = np.divide(turned, np.abs(sizes), out=np.zeros_like(turned), where=sizes != 0.0)
    # what is declared exact stays so
    stds = np.array(stds)
    return tuple(map(tuple, np.where(
        stds > 0.0, np.maximum(stds, np.minimum(share, MOST[kind])), 0.0).tolist()))


def declared_of_modes(model):
    """Return names and deviations of all errors that a LinearModel declares; see `declared`."""
    given, found = of_close_modes(model), []
    if given.exact:
        return (), np.zeros(0)
    for k in range(len(given.frequency)):
        of = f'mode {k + 1}'
        found += [(f'{FREQUENCY} {of}', given.frequency[k]), (f'{DAMPING} {of}', given.damping[k])]
        found += [(f'{PARTICIPATION} {of} {d.name}', std)
                  for d, std in zip(model.drives, given.participation[k])]
        found += [(f'{SHAPE} {of} {s.name}', row[k]) for s, row in zip(model.sensors, given.shape)]
    found += [(f'{GAIN} {s.name}', std) for s, std in zip(model.sensors, given.gain)]
    kept = [(n, s) for n, s in found if s > 0.0]
    return tuple(n for n, _ in kept), np.array([s for _, s in kept])


def basis_of(model):
    """Return modes of mass 1 as columns, (n, n), by rising frequency, and squares of w, (n,)."""
    mass, stiffness = model.mass, model.stiffness
    if all(np.array_equal(m, np.diag(np.diag(m))) for m in (mass, stiffness)):
        # exact, as a state space must keep its modes apart
        squares = np.diag(stiffness) / np.diag(mass)
        order = np.argsort(squares, kind='stable')
        return (np.eye(len(order)) / np.sqrt(np.diag(mass)))[:, order], squares[order]
    squares, shapes = eigh(stiffness, mass)
    return shapes, np.where(np.abs(squares) > RIGID * squares[-1], squares, 0.0)


def modes_at(names, model):
    """Return pairs of a mode, as a column of `basis_of`, and an error's index, by kind."""
    rigid = len(model.mass) - model.vibrating
    found = {kind: {} for kind in MOST}
    inputs, channels = ([d.name for d in model.drives], [s.name for s in model.sensors])
    for i, name in enumerate(names):
        kind, *of = name.split(maxsplit=3)
        try:
            if kind == GAIN:
                at = channels.index(name.split(maxsplit=1)[1])
            else:
                number = int(of[1])
                if not (of[0] == 'mode' and 1 <= number <= model.vibrating):
                    raise ValueError
                at = rigid + number - 1
                if kind == PARTICIPATION:
                    at = at, inputs.index(of[2])
                elif kind == SHAPE:
                    at = channels.index(of[2]), at
            found[kind][at] = i
        except (ValueError, IndexError, KeyError):
            raise ValueError(unknown(f'calibration: error {name!r}', kind, sorted(MOST))
                             + '; or its mode, input or channel is not of this model') from None
    return found


def numbers_of_modes(model):
    """Return a callable from values of the errors of a LinearModel, (m,), to its `Numbers`."""
    shapes, squares = basis_of(model)
    n, where = len(squares), modes_at(model.calibration.names, model)
    force, modal = model.mass @ shapes, shapes.T @ model.damping @ shapes
    driven, shown = shapes.T @ model.input, model.output @ shapes

    def at(values):
        def of(kind, size):
            out = np.zeros(size)
            for place, i in where[kind].items():
                out[place] = values[i]
            return out
        frequency = 1.0 + of(FREQUENCY, n)
        root = np.sqrt(frequency * np.exp(of(DAMPING, n)))
        return Numbers(
            np.array(model.mass),
            model.damping + force @ (modal * (np.outer(root, root) - 1)) @ force.T,
            model.stiffness + (force * (squares * (frequency ** 2 - 1))) @ force.T,
            model.output + (shown * of(SHAPE, shown.shape)) @ force.T,
            1.0 + of(GAIN, len(shown)),
            model.input + force @ (driven * of(PARTICIPATION, driven.shape)))
    return at


def with_modal_errors(system, model):
    """Return the system of a LinearModel with the errors of its calibration in its matrices."""
    if not model.calibration.names:
        return system
    found = numbers_of_modes(model)(np.array(model.calibration.values))
    chain, rest = system.chain, system.quadrature
    if np.any(found.gains != 1.0):
        chain = (Mix(tuple(map(tuple, np.diag(found.gains).tolist()))), *chain)
    if rest is not None:
        # what is a quarter of a period behind errs as the rest of its mode does
        rest = replace(rest, input=rest.input * _ratio(found.input, model.input),
                       shapes=rest.shapes * _ratio(found.sensor, model.output))
    return replace(system, mass=found.mass, damping=found.damping, stiffness=found.stiffness,
                   sensor=found.sensor, input=found.input, chain=chain, quadrature=rest)


def _ratio(one, other):
    """Return one over another, 1 where that is zero."""
    return np.where(other == 0.0, 1.0, one / np.where(other == 0.0, 1.0, other))


def turned(setup, shapes):
    """Return a setup in modal coordinates; freedoms that an effect has added stay as they are."""
    system = setup.system
    turn = np.eye(len(system.dofs))
    turn[:len(shapes), :len(shapes)] = shapes
    names = tuple(f'mode_{i + 1}' for i in range(len(shapes)))
    return replace(setup, system=replace(
        system, mass=_symmetric(turn, system.mass), damping=turn.T @ system.damping @ turn,
        stiffness=_symmetric(turn, system.stiffness), input=turn.T @ system.input,
        sensor=system.sensor @ turn, dofs=names + system.dofs[len(shapes):]))


def _symmetric(turn, matrix):
    found = turn.T @ matrix @ turn
    return (found + found.T) / 2
