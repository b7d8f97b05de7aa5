# Licensed under the Apache License, Version 2.0.
"""Functions drawn at random: of time, of amplitude, of frequency, and of when events happen."""
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import hermite_e


@dataclass(frozen=True)
class Curve:
    """A function of the share of a record, zero mean and rms about one: sines, perhaps bent."""

    cycles: tuple
    amplitudes: tuple
    phases: tuple
    bend: float = 0.0              # 0 smooth; towards steps as it grows

    def at(self, share):
        """Return the values at shares (n,) of the record, 0 to 1."""
        share = np.asarray(share, dtype=float)[..., None]
        value = np.sum(np.array(self.amplitudes) * np.sin(
            2 * np.pi * np.array(self.cycles) * share + np.array(self.phases)), axis=-1)
        value = value / np.sqrt(np.sum(np.square(self.amplitudes)) / 2)
        return np.tanh(self.bend * value) / np.tanh(self.bend) if self.bend else value


def draw_curve(rng, slowest=0.7, fastest=30.0):
    """Draw a function of time with a random band, random terms and perhaps steps."""
    low = np.exp(rng.uniform(np.log(slowest), np.log(fastest / 2)))
    terms = int(rng.integers(1, 9))
    bend = float(rng.choice([0.0, rng.uniform(1, 4)]))
    return Curve(tuple(rng.uniform(low, min(4 * low, fastest), terms).tolist()),
                 tuple(np.abs(rng.standard_normal(terms) + 0.1).tolist()),
                 tuple(rng.uniform(0, 2 * np.pi, terms).tolist()), bend)


@dataclass(frozen=True)
class Response:
    """A frequency response 1 + depth * (sum of residues over s - poles), without its best gain."""

    poles: tuple                   # [rad/s] (real, imaginary), negative real part
    residues: tuple                # (real, imaginary) of each, in units of the pole's width
    depth: float = 1.0
    whole: bool = False            # without the 1: the colour of an input of its own

    def at(self, f):
        """Return H (n,) complex at frequencies f (n,) [Hz]."""
        s = 2j * np.pi * np.asarray(f, dtype=float)[..., None]
        poles = np.array(self.poles) @ [1, 1j]
        residues = np.array(self.residues) @ [1, 1j] * -poles.real
        h = np.sum(residues / (s - poles) + residues.conj() / (s - poles.conj()), axis=-1)
        return self.depth * h + (0.0 if self.whole else 1.0)


def draw_response(rng, low_hz, high_hz, whole=False):
    """Draw one to four pairs of poles between two frequencies, from narrow to wide."""
    count = int(rng.integers(1, 5))
    f = 2 * np.pi * np.exp(rng.uniform(np.log(low_hz), np.log(high_hz), count))
    ratio = np.exp(rng.uniform(np.log(0.05), np.log(0.9), count))
    angle = rng.uniform(0, 2 * np.pi, count)
    height = np.abs(rng.standard_normal(count)) + 0.2
    poles = np.stack([-ratio * f, f * np.sqrt(1 - ratio**2)], axis=1)
    residues = np.stack([height * np.cos(angle), height * np.sin(angle)], axis=1)
    return Response(tuple(map(tuple, poles.tolist())), tuple(map(tuple, residues.tolist())),
                    1.0, whole)


def static(coefficients, z):
    """
    Return a smooth static function of z (any shape), of rms about one for a normal z.

    Hermite polynomials from the second degree on, so that no part of it is an offset or a gain;
    beyond three standard deviations it goes on at its value there.
    """
    series = np.concatenate([[0.0, 0.0], coefficients])
    factorial = np.cumprod(np.arange(1, len(series)))
    norm = np.sqrt(np.sum(series[1:]**2 * factorial))
    return hermite_e.hermeval(np.clip(z, -3, 3), series) / norm


def draw_static(rng):
    """Draw the coefficients of degrees 2 to at most 6, of comparable rms."""
    count = int(rng.integers(1, 6))
    factorial = np.cumprod(np.arange(1, count + 2))[1:]
    return tuple((rng.standard_normal(count) / np.sqrt(factorial)).tolist())


@dataclass(frozen=True)
class Points:
    """A marked point process: rate, clustering, marks, and the length and shape of an event."""

    per_record: float
    clustering: float              # shape of the gamma waiting time; 1 is Poisson
    tail: float                    # 1 normal marks, 0 equal ones, above heavy-tailed
    length: int                    # samples of an event
    decay: float                   # of its envelope over its length
    size: float = 1.0

    def draw(self, samples, record, rng):
        """Return the signal (samples,) of a process with so many samples in its record."""
        mean = record / self.per_record
        count = int(3 * samples / mean) + 20
        waits = rng.gamma(self.clustering, mean / self.clustering, count)
        at = np.cumsum(waits).astype(int)
        at = at[at < samples]
        marks = rng.choice([-1.0, 1.0], len(at)) * np.abs(rng.standard_normal(len(at)))**self.tail
        train = np.bincount(at, marks, samples)
        shape = np.exp(-self.decay * np.arange(self.length) / self.length)
        return self.size * np.convolve(train, shape)[:samples]


def draw_points(rng):
    """Draw a marked point process."""
    return Points(float(np.exp(rng.uniform(np.log(5), np.log(300)))),
                  float(np.exp(rng.uniform(np.log(0.2), np.log(5)))),
                  float(rng.uniform(0, 2.5)), int(rng.integers(1, 12)), float(rng.uniform(0, 6)))
