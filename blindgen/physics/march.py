# Licensed under the Apache License, Version 2.0.
"""
Time integration: exact for the linear part, implicit for the local nonlinear forces.

x(h) = E x + G u + P0 f(0) + P1 f(h): the held loads u go through the exact integral, the local
forces f through a first-order hold whose end value is solved with the law that gives it. So a
stiff stop or a sticking hinge needs no small step. s and r are the deflection and the rate that a
law sees without its force, c = ds/df(h) and m = dr/df its compliance and mobility over a step.

A spring that stiffens without bound would blow up under that hold once its own frequency passes
3.5 / h, as under any linear acceleration. Its force is therefore held over the step at the mean
that does exactly the work that its potential loses (a discrete gradient): no energy is made, at
any stiffness and any step.

The laws, with the base stiffness k of the hinge already in A:
  0 none
  1 freeplay: f = k clip(s, -gap, gap), no moment within the gap          (k, gap)
  2 Coulomb friction: |f| <= T, the hinge stands while it can             (T)
  3 cubic: f = -k3 s^3, over a step its mean -k3 (s + s0) (s^2 + s0^2) / 4  (k3)
  4 surface: f = a(s / s_0) + b(r / r_0), two smooth tables over +-4       (s_0, r_0)
"""
import numba
import numpy as np

LAWS = {'none': 0, 'freeplay': 1, 'friction': 2, 'cubic': 3, 'surface': 4}
REACH = 4.0                 # of the tables of a surface, in its scales


@numba.njit(cache=True, error_model='numpy')
def _table(values, z):
    """Return a table over +-REACH at z, constant beyond."""
    at = (min(max(z, -REACH), REACH) + REACH) / (2 * REACH) * (len(values) - 1)
    low = min(int(at), len(values) - 2)
    return values[low] + (at - low) * (values[low + 1] - values[low])


@numba.njit(cache=True, error_model='numpy')
def law(kind, p, at, table, memory):
    """
    Return the force of one law and renew its memory (2,); see the module for the letters.

    It is the end force, or the force over the step of the laws that hold it (2 and 3). at is
    (s, r, c, m, held), held the mobility (2) or the compliance (3) of a force that is held; table
    (2, points) is that of a surface.
    """
    s, r, c, m, held = at
    if kind == 1:
        inside = s / (1.0 - c * p[0])
        if abs(inside) <= p[1]:
            return p[0] * inside
        return p[0] * p[1] * np.sign(s)
    if kind == 2:
        # Held over the step: the force that stops the hinge, as far as friction reaches.
        return min(max(-r / held, -p[0]), p[0])
    if kind == 3:
        # e + held k3 (e + e0)(e^2 + e0^2) / 4 = s has one root, between -e0 and s; memory is e
        e0, q = memory[0], held * p[0] / 4.0
        low, high, e = min(-e0, s), max(-e0, s), s
        for _ in range(100):
            miss = e + q * (e + e0) * (e * e + e0 * e0) - s
            if miss > 0.0:
                high = e
            else:
                low = e
            ahead = e - miss / (1.0 + q * (3.0 * e * e + 2.0 * e * e0 + e0 * e0))
            if not low < ahead < high:
                ahead = 0.5 * (low + high)
            step, e = ahead - e, ahead
            if abs(step) <= 1e-12 * (abs(e) + abs(e0)):
                break
        memory[0] = e
        return (e - s) / held        # as exact as e, which the law's own cube is not where stiff
    if kind == 4:
        f = 0.0
        for _ in range(6):                   # it is soft: each round is closer by its stiffness
            f = (_table(table[0], (s + c * f) / p[0]) + _table(table[1], (r + m * f) / p[1]))
        return f
    return 0.0


@numba.njit(cache=True, fastmath=True, error_model='numpy')
def _times(matrix, x, out):
    """Add matrix @ x to out, by columns, which are contiguous in a transpose."""
    for j in range(len(x)):
        value = x[j]
        for i in range(len(out)):
            out[i] += matrix[j, i] * value


@numba.njit(cache=True, fastmath=True, error_model='numpy')
def _motion(look, p0, p1, ahead, kind):
    """Return (s, r, c, m, held) of one force that moves along look (n,)."""
    s, r, compliance, mobility, held = 0.0, 0.0, 0.0, 0.0, 0.0
    n = len(look)
    for i in range(n):
        s += look[i] * ahead[i]
        r += look[i] * ahead[n + i]
        compliance += look[i] * p1[i]
        mobility += look[i] * p1[n + i]
        at = i if kind == 3 else n + i
        held += look[i] * (p0[at] + p1[at])
    return s, r, compliance, mobility, held


@numba.njit(cache=True, fastmath=True, error_model='numpy')
def _push(matrices, laws, ahead, forces, carried, memory):
    """Add the local forces of a substep to the state ahead; renew what the next one needs."""
    p0, p1, look = matrices
    kinds, parameters, tables = laws
    for j in range(1, len(kinds)):
        at = _motion(look[j], p0[:, j], p1[:, j], ahead, kinds[j])
        f = law(kinds[j], parameters[j], at, tables[j], memory[j])
        forces[j] = f
        if kinds[j] == 2 or kinds[j] == 3:       # held: not carried into the next step
            for i in range(len(ahead)):
                ahead[i] += (p0[i, j] + p1[i, j]) * f
            if kinds[j] == 3:                    # a sensor has the force at its end
                forces[j] = -parameters[j, 0] * memory[j, 0]**3
        else:
            carried[j] = f
            for i in range(len(ahead)):
                ahead[i] += p1[i, j] * f


@numba.njit(cache=True, fastmath=True, error_model='numpy')
def march(matrices, laws, x, u, smooth, per_block):
    """
    Integrate and return the accelerations at the samples.

    Parameters
    ----------
    matrices : tuple of arrays
        Propagators of each block of `per_block` samples, E (blocks, 2n, 2n), G (blocks, 2n, k),
        P0 and P1 (blocks, 2n, m), force 0 being the smooth torque; accelerations from state, held
        loads and local forces C (blocks, c, 2n), D (blocks, c, k), E (blocks, c, m); and along
        what each force moves (m, n).
    laws : tuple of arrays
        Of each local force: kind (m,) int, parameters (m, 2), tables (m, 2, points).
    x : (2n,) array
        State at the start; it is overwritten by the state at the end.
    u : (samples, k) array
        Loads held over each sample.
    smooth : (samples * substeps + 1,) array
        Torque about x_b at every substep [N m].
    per_block : int
        Samples that share one block of matrices.

    Returns
    -------
    (samples, c) array
        [m/s^2]

    """
    e, g, p0, p1, c, d, ell, look = matrices
    samples, m = len(u), len(laws[0])
    substeps = (len(smooth) - 1) // samples
    y = np.zeros((samples, c.shape[1]))
    forces, carried, memory = np.zeros(m), np.zeros(m), np.zeros((m, 2))
    ahead, pushed, last = np.zeros(len(x)), np.zeros(len(x)), -1
    for k in range(samples):
        b = min(k // per_block, len(e) - 1)
        if b != last:
            last = b
            et, gt, p0t = e[b].T.copy(), g[b].T.copy(), p0[b].T.copy()
            ct, dt, lt = c[b].T.copy(), d[b].T.copy(), ell[b].T.copy()
        forces[0] = carried[0] = smooth[k * substeps]
        _times(ct, x, y[k])
        _times(dt, u[k], y[k])
        _times(lt, forces, y[k])
        pushed[:] = 0.0
        _times(gt, u[k], pushed)
        for sub in range(substeps):
            forces[0] = smooth[k * substeps + sub + 1]
            for i in range(len(x)):
                ahead[i] = pushed[i] + p1[b, i, 0] * forces[0]
            _times(et, x, ahead)
            _times(p0t, carried, ahead)
            _push((p0[b], p1[b], look), laws, ahead, forces, carried, memory)
            carried[0] = forces[0]
            x[:] = ahead
    return y
