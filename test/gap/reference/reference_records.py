"""Small structures with known answers, for the tests of the reference diagnosis."""
import numpy as np
from scipy.signal import cont2discrete, lfilter
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.records import Samples

RATE_HZ = 50.0
MODES = ((2.1, 0.01), (5.3, 0.008), (9.7, 0.01))
SHAPES = np.array([[1.0, 0.8, 0.6], [0.7, -0.9, 0.3], [0.4, 0.5, -1.0]])
NOISE = 0.01


def diagnose_reference(reference, record, *settings, **options):
    """Diagnose a recording against another of the same structure."""
    return diagnose(RecordedNominal(reference), record, *settings, **options)


def chain(seed, seconds=240.0, scale=(1.0, 1.0, 1.0), damping=1.0, level=1.0, channels=3):
    """Return accelerations of three modes under white forces; `scale` multiplies stiffness."""
    rng = np.random.default_rng(seed)
    rows = int(seconds * RATE_HZ)
    modal = []
    for (f, xi), s in zip(MODES, scale):
        w, d = 2 * np.pi * f * np.sqrt(s), xi * damping
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * d * w, w ** 2]), 1 / RATE_HZ)
        modal.append(lfilter(np.ravel(b), a, rng.standard_normal(rows + 2000))[2000:])
    values = level * np.array(modal).T @ SHAPES.T
    values = values + NOISE * rng.standard_normal(values.shape)
    return Samples(values[:, :channels], RATE_HZ, ('a', 'b', 'c')[:channels])


def slipping(seed, level, seconds=200.0):
    """
    Return two accelerations of two masses, of which the second slips in its joint.

    The joint is an elastic-plastic spring (Jenkins element): stiff below its yield force, sliding
    beyond. The excitation ends at 8 Hz, so what is above it is distortion.
    """
    rng = np.random.default_rng(seed)
    steps = 20
    rows = int(seconds * RATE_HZ)
    force = rng.standard_normal(rows + 500)
    spectrum = np.fft.rfft(force)
    spectrum[np.fft.rfftfreq(len(force), 1 / RATE_HZ) > 8.0] = 0.0
    force = level * np.fft.irfft(spectrum, len(force)) * 20.0
    k1, k2, kj, slip = (2 * np.pi * 2.0) ** 2, 300.0, 40.0, 0.3
    dt = 1 / RATE_HZ / steps
    x1 = x2 = v1 = v2 = joint = 0.0
    out = np.empty((len(force), 2))
    for i, f in enumerate(force.tolist()):
        for _ in range(steps):
            joint = min(max(joint + kj * (v2 - v1) * dt, -slip), slip)
            between = k2 * (x2 - x1) + joint + 0.4 * (v2 - v1)
            a1 = f - k1 * x1 - 0.3 * v1 + between
            a2 = -between
            v1 += a1 * dt
            v2 += a2 * dt
            x1 += v1 * dt
            x2 += v2 * dt
        out[i] = a1, a2
    values = out[500:] + 1e-3 * rng.standard_normal((rows, 2))
    return Samples(values, RATE_HZ, ('base', 'tip'))


PERIOD = 1000           # rows of the signal of `shaken`


def shaken(seed, periods=6.0, begin=0.0, ppm=0.0, scale=(1.0, 1.0), added=None, level=None,
           step=1, draw=0):
    """
    Return the three modes under a multisine that repeats itself after 20 s, with 0.3 % of noise.

    The recording begins `begin` rows into the signal; `scale` is that of all stiffness in the
    first and in the last period; `added` and `level` are functions of the time [s], of what is
    put on all channels in shares of their rms and of what they are multiplied with; `step` is that
    of the lines, `draw` that of their phases.
    """
    lines = np.arange(10, 240, step)
    phases = np.random.default_rng(draw).uniform(0, 2 * np.pi, len(lines))
    rows = int(periods * PERIOD)
    instants = begin + np.arange(rows) * (1 + 1e-6 * ppm)
    count = int(np.ceil(periods))
    values = np.empty((rows, 3))
    f = lines * RATE_HZ / PERIOD
    for k in range(count):
        here = slice(k * PERIOD, (k + 1) * PERIOD)
        at = scale[0] + (scale[1] - scale[0]) * k / max(count - 1, 1)
        waves = np.exp(1j * (2 * np.pi * np.outer(instants[here], lines) / PERIOD + phases))
        modal = [f ** 2 / (f0 ** 2 * at - f ** 2 + 2j * xi * f0 * np.sqrt(at) * f)
                 for f0, xi in MODES]
        values[here] = (waves @ (np.array(modal).T @ SHAPES.T)).real
    rms = values.std(axis=0)
    t = np.arange(rows) / RATE_HZ
    if level is not None:
        values = values * level(t)[:, None]
    if added is not None:
        values = values + added(t)[:, None] * rms
    noise = np.random.default_rng(seed).standard_normal(values.shape)
    return Samples(values + 3e-3 * rms * noise, RATE_HZ, ('a', 'b', 'c'))
