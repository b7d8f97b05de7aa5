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
  4 Bouc-Wen: f = k (s - z), z' = r - |r| z / 2 z_y - r |z| / 2 z_y       (k, z_y)
  5 quadratic damping: f = -c |r| r                                       (c)
  6 pumped stiffness: f = -k cos(w t) s                                   (k, w)
  7 one-sided contact: f = -k max(s - gap, 0)                             (k, gap)
  8 slider in series with a spring: |f| <= T                              (k, T)
"""
import numba
import numpy as np

LAWS = {'none': 0, 'freeplay': 1, 'friction': 2, 'cubic': 3, 'bouc_wen': 4, 'quadratic': 5,
        'pumped': 6, 'contact': 7, 'slider': 8}


@numba.njit(cache=True, error_model='numpy')
def law(kind, p, s, r, c, m, held, t, memory):
    """
    Return the force of one law and renew its memory (2,); see the module for the letters.

    It is the end force, or the force over the step of the laws that hold it (2 and 3); held is
    the mobility (2) or the compliance (3) of such a force, t the time at the end of the step.
    """
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
        # memory is s - z and s, so that z follows from the deflection without drift
        slip = memory[0]
        for _ in range(40):                 # k c is 0.5 at most: 40 halvings
            end = s + c * p[0] * slip
            gone, z = end - memory[1], end - slip
            slip = memory[0] + (abs(gone) * z + gone * abs(z)) / (2.0 * p[1])
        memory[0], memory[1] = slip, s + c * p[0] * slip
        return p[0] * slip
    if kind == 5:
        f = 0.0
        for _ in range(8):
            rate = r + m * f
            f -= (f + p[0] * abs(rate) * rate) / (1.0 + 2.0 * p[0] * abs(rate) * m)
        return f
    if kind == 6:
        k = p[0] * np.cos(p[1] * t)
        return -k * s / (1.0 + k * c)
    if kind == 7:
        if s <= p[1]:
            return 0.0
        return -p[0] * (s - p[1]) / (1.0 + p[0] * c)
    if kind == 8:
        f = -p[0] * (s - memory[0]) / (1.0 + p[0] * c)
        if abs(f) > p[1]:
            f = p[1] * np.sign(f)
            memory[0] = s + c * f + f / p[0]
        return f
    return 0.0


@numba.njit(cache=True, fastmath=True, error_model='numpy')
def march(e, g, p0, p1, c, d, ell, look, kinds, parameters, x, u, smooth, step_s, per_block):
    """
    Integrate and return the accelerations at the samples.

    Parameters
    ----------
    e, g, p0, p1 : (blocks, 2n, 2n), (blocks, 2n, 22), (blocks, 2n, m), (blocks, 2n, m) arrays
        Propagators of each block of `per_block` samples; force 0 is the smooth torque.
    c, d, ell : (blocks, 4, 2n), (blocks, 4, 22), (blocks, 4, m) arrays
        Accelerations from state, held loads and local forces.
    look : (m, n) array
        Deflection that each local force sees.
    kinds : (m,) int array
        Law of each local force.
    parameters : (m, 2) array
        Of each law, in the order of the module's list.
    x : (2n,) array
        State at the start; it is overwritten by the state at the end.
    u : (samples, 22) array
        Loads held over each sample.
    smooth : (samples * substeps + 1,) array
        Torque about x_b at every substep [N m].
    step_s : float
        Substep [s].
    per_block : int
        Samples that share one block of matrices.

    Returns
    -------
    (samples, 4) array
        [m/s^2]

    """
    samples, loads = u.shape
    substeps = (len(smooth) - 1) // samples
    two_n = len(x)
    n = two_n // 2
    m = len(kinds)
    y = np.zeros((samples, 4))
    forces, carried, memory = np.zeros(m), np.zeros(m), np.zeros((m, 2))
    pushed, ahead = np.zeros(two_n), np.zeros(two_n)
    transpose = np.zeros((two_n, two_n))
    last = -1
    for k in range(samples):
        b = min(k // per_block, len(e) - 1)
        if b != last:
            last = b
            for i in range(two_n):
                for j in range(two_n):
                    transpose[j, i] = e[b, i, j]
        forces[0] = smooth[k * substeps]
        carried[0] = forces[0]
        for i in range(4):
            value = 0.0
            for j in range(two_n):
                value += c[b, i, j] * x[j]
            for j in range(loads):
                value += d[b, i, j] * u[k, j]
            for j in range(m):
                value += ell[b, i, j] * forces[j]
            y[k, i] = value
        for i in range(two_n):
            value = 0.0
            for j in range(loads):
                value += g[b, i, j] * u[k, j]
            pushed[i] = value
        for sub in range(substeps):
            t = (k * substeps + sub + 1) * step_s
            forces[0] = smooth[k * substeps + sub + 1]
            for i in range(two_n):
                ahead[i] = pushed[i] + p1[b, i, 0] * forces[0]
            for j in range(two_n):
                value = x[j]
                for i in range(two_n):
                    ahead[i] += transpose[j, i] * value
            for j in range(m):
                if carried[j] != 0.0:
                    for i in range(two_n):
                        ahead[i] += p0[b, i, j] * carried[j]
            for j in range(1, m):
                s, r, compliance, mobility, held = 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(n):
                    s += look[j, i] * ahead[i]
                    r += look[j, i] * ahead[n + i]
                    compliance += look[j, i] * p1[b, i, j]
                    mobility += look[j, i] * p1[b, n + i, j]
                    at = i if kinds[j] == 3 else n + i
                    held += look[j, i] * (p0[b, at, j] + p1[b, at, j])
                f = law(kinds[j], parameters[j], s, r, compliance, mobility, held, t,
                        memory[j])
                forces[j] = f
                if kinds[j] == 2 or kinds[j] == 3:      # held: not carried into the next step
                    for i in range(two_n):
                        ahead[i] += (p0[b, i, j] + p1[b, i, j]) * f
                    if kinds[j] == 3:                   # a sensor sees the force at its end
                        forces[j] = -parameters[j, 0] * memory[j, 0]**3
                else:
                    carried[j] = f
                    for i in range(two_n):
                        ahead[i] += p1[b, i, j] * f
            carried[0] = forces[0]
            for i in range(two_n):
                x[i] = ahead[i]
    return y
