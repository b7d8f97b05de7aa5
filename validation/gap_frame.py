"""
Diagnose a frame of a base and three floors against a recording of it: masses, storeys, a bumper.

    python -m validation.gap_frame

As laboratories have them: 25.6 s at 320 Hz, an accelerometer on every floor, a shaker at the base
from 20 to 150 Hz, and a bumper that the third floor meets beyond a gap.
"""
import time

import numba
import numpy as np
from scipy.signal import butter, sosfilt
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.records import Samples

from validation.report import table

HEAD = 'noise [%]', 'changed', 'outcome', 'site', 'reason', 'CPU s'
RATE_HZ, SECONDS, SETTLING_S, STEPS = 320.0, 25.6, 3.0, 16
MASS_KG, STOREY_N_M, BASE_N_M = 6.5, 3.0e5, 2e3
RATIOS = 0.06, 0.018, 0.01, 0.008       # of the modes of the healthy frame
BAND_HZ, FORCE_N = (20.0, 150.0), 20.0
BUMPER_N_M, BUMPER_NS_M = 2e6, 50.0
APART_M = 1.14e-4       # rms of what the third floor moves against the second
NOISES = 0.002, 0.05    # of the rms of all channels
CHANGES = {
    'nothing': {}, 'nothing, again': {}, '10 % more force': {'force': 1.1},
    '1.2 kg on the base': {'added': (1.2, 0, 0, 0)},
    '1.2 kg on the first floor': {'added': (0, 1.2, 0, 0)},
    '22 % of the first storey': {'kept': (0.78, 1, 1)},
    '22 % of the second storey': {'kept': (1, 0.78, 1)},
    '22 % of the third storey': {'kept': (1, 1, 0.78)},
    'a bumper at 3.5 rms': {'gap': 3.5}, 'a bumper at 2.5 rms': {'gap': 2.5},
    'a bumper at 1 rms': {'gap': 1.0}}


def matrices(added=(0.0,) * 4, kept=(1.0,) * 3):
    """Return masses (4,), stiffness (4, 4) and damping (4, 4), which no change moves."""
    healthy, masses = np.full(4, MASS_KG), MASS_KG + np.array(added)
    ends = np.diff(np.eye(4), axis=0)
    base = np.diag([BASE_N_M, 0.0, 0.0, 0.0])
    usual, now = (ends.T @ np.diag(STOREY_N_M * np.array(k)) @ ends + base
                  for k in ((1.0,) * 3, kept))
    squares, modes = np.linalg.eigh(usual / np.sqrt(np.outer(healthy, healthy)))
    modal = np.sqrt(healthy)[:, None] * modes
    return masses, now, modal @ np.diag(2 * np.array(RATIOS) * np.sqrt(squares)) @ modal.T


@numba.njit(cache=True)
def moved(masses, stiffness, damping, force, dt, gap):
    """Return accelerations (n, 4) under a force on the base (n,), by velocity Verlet."""
    x, v, a = np.zeros(4), np.zeros(4), np.zeros(4)
    found = np.empty((len(force), 4))
    for k in range(len(force)):
        x = x + v * dt + a * dt * dt / 2
        half = v + a * dt / 2
        pull = -stiffness @ x - damping @ half
        pull[0] += force[k]
        if x[3] - x[2] > gap:
            push = BUMPER_N_M * (x[3] - x[2] - gap) + BUMPER_NS_M * max(half[3] - half[2], 0.0)
            pull[3] -= push
            pull[2] += push
        new = pull / masses
        v, a = half + new * dt / 2, new
        found[k] = a
    return found


def record(seed, noise, force=1.0, gap=np.inf, **change):
    """Return Samples of the frame."""
    rng, rate = np.random.default_rng(seed), RATE_HZ * STEPS
    drawn = sosfilt(butter(4, BAND_HZ, 'band', fs=rate, output='sos'),
                    rng.standard_normal(int((SECONDS + SETTLING_S) * rate)))
    values = moved(*matrices(**change), force * FORCE_N * drawn / drawn.std(), 1 / rate,
                   gap * APART_M)
    values = sosfilt(butter(8, 0.4 * RATE_HZ, fs=rate, output='sos'), values, axis=0)
    values = values[int(SETTLING_S * rate)::STEPS]
    values = values + noise * values.std() * rng.standard_normal(values.shape)
    return Samples(values, RATE_HZ, ('base', 'first', 'second', 'third'))


def main():
    """Print one row a change and a level of noise."""
    rows = []
    for noise in NOISES:
        reference = RecordedNominal(record(0, noise))
        for seed, (name, change) in enumerate(CHANGES.items(), 1):
            begin, now = time.process_time(), record(seed, noise, **change)
            found = diagnose(reference, now)
            site, share = max(found.where.site.items(), key=lambda s: s[1])
            rows.append((f'{100 * noise:g}', name, found.outcome,
                         f'{site} {100 * share:.0f} %' if share > 0.0 else '',
                         found.reason.split(', which no effect')[0],
                         f'{time.process_time() - begin:.1f}'))
    print('\n'.join(table(HEAD, rows)))


if __name__ == '__main__':
    main()
