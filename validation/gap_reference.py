"""
Measure the diagnosis against a reference recording: false alarms, effects, measured records.

    python -m validation.gap_reference null 100        (600 s; also null 100 120, null 100 120 1)
    python -m validation.gap_reference effects
    SSI_ROS_DATA=FOLDER python -m validation.gap_reference records
"""
import argparse
import os
from pathlib import Path
import time

import numpy as np
from scipy.io import loadmat
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.gap.nominal.simulator import at_levels
from ssi_ros.model import load_spacecraft
from ssi_ros.records import Samples

CASES = (
    'excitation_colour:corner_hz=40', 'harmonic_disturbance:frequency_hz=12.345,torque_n_m=0.3',
    'wheel_speed_sweep:start_hz=4,end_hz=14,torque_n_m=0.5',
    'impulsive_events:rate_per_min=6,impulse_n_m_s=0.1',
    'nonstationary_excitation:depth=0.5,period_s=120', 'stiffness_scale:scale=0.99',
    'array_asymmetry:array=E2,scale=0.99', 'damping_scale:scale=1.4', 'hub_inertia:scale=1.2',
    'added_mass:array=E1,mass_kg=0.2,along_m=6,lateral_m=0.5',
    'hinge_compliance:array=E2,stiffness_n_m_rad=1e5',
    'hinge_freeplay:array=E1,gap_rad=1e-5,stiffness_n_m_rad=1e5',
    'hinge_friction:array=E1,torque_n_m=0.05,stiffness_n_m_rad=1e5',
    'cubic_stiffness:array=E2,k3_n_m_rad3=1e13,stiffness_n_m_rad=1e5',
    'stiffness_drift:change=0.03',
    'fuel_slosh:mass_kg=40,frequency_hz=2.5,damping_ratio=0.02,arm_m=1',
    'attitude_controller:bandwidth_hz=0.4,damping_ratio=0.7',
    'gyroscopic_coupling:momentum_n_m_s=400', 'sensor_gain:channel=e2_a,scale=1.02',
    'sensor_crosstalk:source=e2_a,channel=e1_a,gain=0.03',
    'sensor_misplacement:channel=e1_b,along_m=-0.15,lateral_m=0.05',
    'sensor_noise:channel=e1_b,scale=4',
    'sensor_drift:channel=e1_a,rms_m_s2=0.003,time_constant_s=5', 'quantisation:step_m_s2=0.001',
    'saturation:limit_m_s2=0.1', 'sensor_bandwidth:channel=all,corner_hz=40',
    'channel_delay:channel=e1_b,delay_s=0.001', 'clock_rate:ppm=2000',
    'timestamp_jitter:rms_s=0.001', 'dropped_samples:fraction=0.02')
SECONDS = 600.0


def data_folder():
    """Return the folder of the measured records."""
    return Path(os.environ.get('SSI_ROS_DATA', '../shared/data'))


def null(runs, duration_s=SECONDS, channels=4):
    """Print how often two records of one spacecraft are found to differ; levels within 3 dB."""
    quiet = load_spacecraft()
    alarms = []
    for seed in range(runs):
        loud = at_decibel(quiet, np.random.default_rng(seed).uniform(-3, 3))
        pair = [few(simulate_setup(inject(s, (), duration_s), 30_000 + 2 * seed + k), channels)
                for k, s in enumerate((quiet, loud))]
        found = diagnose(RecordedNominal(pair[0]), pair[1])
        alarms.append(found.outcome != 'WITHIN_FLOOR')
        if alarms[-1]:
            print(f'{seed}: p = {found.gap["p_value"]:.2g}, {found.reason[:90]}, {found.signs}',
                  flush=True)
    print(f'{sum(alarms)} alarms in {runs} pairs of {duration_s:g} s, {channels} channels')


def at_decibel(spacecraft, level, noise=1.0):
    """Return the spacecraft with all of its excitation at a level [dB], and its noise."""
    power = 10 ** (level / 10)
    return at_levels(spacecraft, (power, power, noise ** 2))


def few(samples, channels):
    """Return the first channels."""
    return Samples(samples.values[:, :channels], samples.rate_hz, samples.channels[:channels])


def effects(first=0, step=1):
    """Print what is said of every case."""
    spacecraft = load_spacecraft()
    print('| injected | outcome | named | in class | site right | closed | CPU s |\n' + '|---' * 7
          + '|', flush=True)
    for k, case in list(enumerate(CASES))[first::step]:
        effect = parse_effect(case)
        before = simulate_setup(inject(spacecraft, (), SECONDS), 50_000 + k)
        after = simulate_setup(inject(spacecraft, [effect], SECONDS), 60_000 + k)
        begin = time.process_time()
        found = diagnose(RecordedNominal(before), after)
        took = time.process_time() - begin
        site = max(found.where.site, key=found.where.site.get)
        place = [k.split('.', 1)[1] for k in found.candidates[0].parameters if k.count('.') > 1]
        print(f'| {case} | {found.outcome} | {" + ".join(found.verdict["effects"])} '
              f'{" ".join(place)} | {"yes" if effect.name in found.verdict["class"] else "no"} | '
              f'{"yes" if site == effect.site.value else site} | '
              f'{found.candidates[0].closed:.2f} | {took:.1f} |', flush=True)


def f16(level, folder):
    """Return the three accelerations of a level of the F-16 ground vibration test."""
    data = np.load(folder / f'f16_level{level}.npz')
    return Samples(data['acceleration'].astype(float), float(data['rate_hz']),
                   ('shaker', 'wing', 'payload'))


def bridge(folder):
    """Return the simulated bridge of E. Cheynet."""
    rows = np.asarray(loadmat(folder / 'BridgeData.mat')['rz'], float)
    return Samples(rows.T if rows.shape[0] < rows.shape[1] else rows, 15.0, tuple('abcde'))


def halves(samples):
    """Return both halves of a record."""
    return (samples.between(0.0, samples.duration_s / 2),
            samples.between(samples.duration_s / 2, samples.duration_s))


def records():
    """Print the diagnoses of the measured records."""
    from ssi_ros.cli.diagnose import text
    folder = data_folder()
    one, two, five = (f16(level, folder) for level in (1, 2, 5))
    for name, pair in (('level 1, its halves', halves(one)), ('level 5', (one, five)),
                       ('level 2', (one, two)), ('bridge, its halves', halves(bridge(folder)))):
        begin = time.process_time()
        found = diagnose(RecordedNominal(pair[0]), pair[1])
        print(f'## {name} ({time.process_time() - begin:.1f} s CPU)\n\n```\n{text(found)}\n'
              f'class: {", ".join(found.verdict["class"])}\n```\n', flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('kind', choices=('null', 'effects', 'records'))
    parser.add_argument('numbers', nargs='*', type=int,
                        help='of null: runs, seconds of a record, channels')
    given = parser.parse_args()
    {'null': null, 'effects': effects, 'records': records}[given.kind](*given.numbers)
