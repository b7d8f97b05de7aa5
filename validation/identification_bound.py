"""
How well frequencies and shapes can be known at all: the Cramer-Rao bound beside what is found.

    python -m validation.identification_bound --seeds 20

The bound is that of Whittle for a Gaussian record of T seconds, F_ab = T times the integral over
frequency of tr(S^-1 dS_a S^-1 dS_b), and of the model that SSI-COV has: every mode a complex pole
mu, shape psi and vector g, Lambda_k = sum of psi mu^(k-1) g^T + conjugate, and white noise of any
covariance. A shape is wrong by what lies across it, so 1 - MAC is at least the trace of the
covariance of psi across psi, as long as that is small.
"""
import argparse

import numpy as np
from scipy.integrate import trapezoid
from ssi_ros.identify.ssi_cov import ssi_cov
from threadpoolctl import threadpool_limits
from validation.bench_data import modal_record, RATE_HZ, ten_modes, twin_arrays
from validation.bench_measure import errors, summary
from validation.bench_methods import Poles

NOISE = 0.05            # of the rms of a channel, as in `modal_record`


def modes_of(truth, common):
    """Return poles mu (p,), shapes (p, l) and vectors g (p, l) of `modal_record`, and Lambda_0."""
    w, xi, dt = 2.0 * np.pi * truth.frequency_hz, truth.damping_ratio, 1.0 / RATE_HZ
    damped = w * np.sqrt(1.0 - xi ** 2)
    mu = np.exp((-xi * w + 1j * damped) * dt)
    turned = np.exp(-xi * w * dt) * (np.cos(damped * dt)
                                     - xi / np.sqrt(1.0 - xi ** 2) * np.sin(damped * dt))
    first = turned - 2.0 * mu.real - 1.0            # numerator 1 + first / z - (1 + first) / z^2
    force = np.sqrt(xi / w)
    forces = common + (1.0 - common) * np.eye(len(w))

    def numerator(z):
        return force * (1.0 + first / z - (1.0 + first) / z ** 2)

    def gain(z):
        return numerator(z) / ((1.0 - mu / z) * (1.0 - mu.conj() / z))

    # the residue of psi_j H_j(z) F_jk H_k(1/z) psi_k^T at z = mu_j
    g = np.array([numerator(m)[j] * m / (1.0 - m.conj() / m)
                  * ((forces[j] * gain(1.0 / m)) @ truth.shapes) for j, m in enumerate(mu)])
    f = grid(truth)
    z = np.exp(2j * np.pi * f / RATE_HZ)
    swing = np.array([gain(one) for one in z])[:, None, :] * truth.shapes.T
    power = trapezoid((swing @ forces @ swing.conj().transpose(0, 2, 1)).real, f, axis=0)
    return mu, truth.shapes.astype(complex), g, 2.0 * power / RATE_HZ


def grid(truth):
    """Return frequencies [Hz] that are dense where the peaks are."""
    reach = np.sinh(np.linspace(-7.0, 7.0, 401))
    near = [f + x * f * reach for f, x in zip(truth.frequency_hz, truth.damping_ratio)]
    every = np.unique(np.concatenate([np.linspace(0.0, RATE_HZ / 2.0, 801), *near]))
    return every[(every > 1e-3) & (every < RATE_HZ / 2.0 - 1e-3)]


def information(mu, psi, g, lambda_0, f):
    """
    Return the Fisher information of one second, and the number of parameters of a mode.

    The parameters of a mode are the real and then the imaginary parts of mu, of psi without its
    largest component, which is 1, and of g; those of Lambda_0 are the last.
    """
    width, z = psi.shape[1], np.exp(2j * np.pi * f / RATE_HZ)[:, None, None]
    total, slopes = np.zeros((len(f), width, width), dtype=complex), []

    def both(term, turn=1.0):
        """Return a change along turn, of a pole and of its conjugate, and of what mirrors both."""
        a = turn * term(z) + np.conj(turn * term(z.conj()))
        return a + a.conj().transpose(0, 2, 1)

    for m, s, q in zip(mu, psi, g):
        top = np.abs(s).argmax()
        s, q, unit = s / s[top], q * s[top], np.eye(width)
        total += both(lambda z: np.outer(s, q) / (z - m))
        terms = [lambda z: np.outer(s, q) / (z - m) ** 2]
        terms += [lambda z, e=e: np.outer(e, q) / (z - m) for e in np.delete(unit, top, axis=0)]
        terms += [lambda z, e=e: np.outer(s, e) / (z - m) for e in unit]
        slopes += [both(t, turn) for turn in (1.0, 1j) for t in terms]
    for i, j in zip(*np.triu_indices(width)):
        e = np.zeros((width, width))
        e[i, j] = e[j, i] = 1.0
        slopes.append(np.broadcast_to(e.astype(complex), total.shape))
    inverse = np.linalg.inv(total + lambda_0)
    moved = np.array([inverse @ s for s in slopes])
    weight = np.gradient(f)[:, None, None]
    flat = (moved * weight).reshape(len(moved), -1)
    return (flat @ moved.transpose(0, 1, 3, 2).reshape(len(moved), -1).T).real, 4 * width


def bound(truth, duration_s, common):
    """Return the least relative standard deviations of frequency, and 1 - MAC, of every mode."""
    mu, psi, g, power = modes_of(truth, common)
    lambda_0 = power + NOISE ** 2 * np.diag(np.diag(power))
    fisher, size = information(mu, psi, g, lambda_0, grid(truth))
    unit = 1.0 / np.sqrt(np.diag(fisher))
    spread = np.linalg.inv(fisher * np.outer(unit, unit)) * np.outer(unit, unit) / duration_s
    frequency, lost = [], []
    half = size // 2
    for j, (m, s) in enumerate(zip(mu, psi)):
        own = spread[j * size:(j + 1) * size, j * size:(j + 1) * size]
        lam = np.log(m) * RATE_HZ                            # d|lambda| of d mu = d lambda mu dt
        slope = lam.conj() * RATE_HZ / m / np.abs(lam) ** 2
        along = np.array([slope.real, -slope.imag])
        frequency.append(np.sqrt(along @ own[np.ix_([0, half], [0, half])] @ along))
        top, width = np.abs(s).argmax(), len(s)
        re = np.arange(1, width)
        c = (own[np.ix_(re, re)] + own[np.ix_(re + half, re + half)]
             + 1j * (own[np.ix_(re + half, re)] - own[np.ix_(re, re + half)]))
        s = s / s[top]
        rest = np.delete(np.arange(width), top)
        across = np.eye(width) - np.outer(s, s.conj()) / np.vdot(s, s)
        lost.append(np.trace(across[np.ix_(rest, rest)] @ c).real / np.vdot(s, s).real)
    return np.array(frequency), np.array(lost)


def found(truth, duration_s, common, seeds, orders):
    """Return rms relative error of frequency and mean MAC at the best order of SSI-COV, CVA."""
    tables = {n: [] for n in orders}
    with threadpool_limits(1):
        for seed in seeds:
            values = modal_record(truth, duration_s, seed, NOISE, common)
            for p in ssi_cov(values, RATE_HZ, 50, orders):
                tables[p.order].append(errors(truth, Poles(
                    p.order, p.frequency_hz, p.damping_ratio, p.shapes)))
    return min(((s[0], s[2]) for s in map(summary, tables.values())), key=lambda s: s[0])


def main():
    """Print one line a case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seeds', type=int, default=20)
    args = parser.parse_args()
    print('| case | rms frequency error [%] | least [%] | MAC, mean | at most, first order |')
    print('|---|---|---|---|---|')
    pairs = range(8, 41, 2)
    for name, truth, common, seconds, orders in (
            ('ten modes, 60 s', ten_modes(), 0.0, 60.0, range(20, 61, 2)),
            ('ten modes, 600 s', ten_modes(), 0.0, 600.0, range(20, 61, 2)),
            ('two close pairs, 600 s', twin_arrays(), 0.0, 600.0, pairs),
            ('the same, correlation 0.7', twin_arrays(), 0.7, 600.0, pairs),
            ('the same, 5000 s', twin_arrays(), 0.7, 5000.0, pairs)):
        f, lost = bound(truth, seconds, common)
        rms, mac = found(truth, seconds, common, range(args.seeds), orders)
        print(f'| {name} | {100 * rms:.4f} | {100 * np.sqrt((f ** 2).mean()):.4f} | {mac:.4f} | '
              f'{1.0 - lost.mean():.4f} |', flush=True)


if __name__ == '__main__':
    main()
