"""
Measure the diagnosis on the package's own simulator: false alarms, confusion, sizes, shrinkage.

    python -m validation.gap_campaign null 400 > null.txt
    python -m validation.gap_campaign effects 2 > effects.txt
"""
import sys
import time

import numpy as np

from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.diagnose import diagnose
from ssi_ros.model import load_spacecraft

SECONDS = 600.0
CASES = (
    'excitation_colour:corner_hz=40', 'harmonic_disturbance:frequency_hz=12.345,torque_n_m=0.3',
    'wheel_speed_sweep:start_hz=4,end_hz=14,torque_n_m=0.5',
    'impulsive_events:rate_per_min=6,impulse_n_m_s=0.05',
    'nonstationary_excitation:depth=0.5,period_s=120', 'stiffness_scale:scale=0.99',
    'array_asymmetry:array=E2,scale=0.99', 'damping_scale:scale=1.4', 'hub_inertia:scale=1.1',
    'added_mass:array=E1,mass_kg=0.2,along_m=6,lateral_m=0.5',
    'hinge_compliance:array=E2,stiffness_n_m_rad=1e5',
    'hinge_freeplay:array=E1,gap_rad=1e-5,stiffness_n_m_rad=1e5',
    'hinge_friction:array=E1,torque_n_m=0.05,stiffness_n_m_rad=1e5',
    'cubic_stiffness:array=E2,k3_n_m_rad3=1e13,stiffness_n_m_rad=1e5',
    'stiffness_drift:change=0.02',
    'fuel_slosh:mass_kg=20,frequency_hz=0.9,damping_ratio=0.02,arm_m=1',
    'attitude_controller:bandwidth_hz=0.1,damping_ratio=0.7',
    'gyroscopic_coupling:momentum_n_m_s=80', 'sensor_gain:channel=e2_a,scale=1.02',
    'sensor_crosstalk:source=e2_a,channel=e1_a,gain=0.03',
    'sensor_misplacement:channel=e1_b,along_m=-0.15,lateral_m=0.05',
    'sensor_noise:channel=e1_b,scale=1.3',
    'sensor_drift:channel=e1_a,rms_m_s2=0.003,time_constant_s=5', 'quantisation:step_m_s2=0.001',
    'saturation:limit_m_s2=0.1', 'sensor_bandwidth:channel=all,corner_hz=40',
    'channel_delay:channel=e1_b,delay_s=0.001', 'clock_rate:ppm=2000',
    'timestamp_jitter:rms_s=0.001', 'dropped_samples:fraction=0.02')


def null(runs):
    """Print how often a right model is called wrong."""
    spacecraft = load_spacecraft()
    setup = inject(spacecraft, (), SECONDS)
    alarms, values = 0, []
    for seed in range(runs):
        found = diagnose(spacecraft, simulate_setup(setup, 10_000 + seed), pairs=False)
        alarms += found.outcome != 'WITHIN_FLOOR'
        values.append(found.gap['p_value'])
        deviations = (found.gap['before'] - found.gap['floor']) / found.gap['floor_std']
        print(f'{seed} {found.outcome} p={found.gap["p_value"]:.3g} sd={deviations:.2f}',
              flush=True)
    print(f'{alarms} alarms in {runs} runs ({100 * alarms / runs:.2f} %); quantiles of p at 1, 5, '
          f'10, 50 %: {np.quantile(values, [0.01, 0.05, 0.1, 0.5]).round(3)}')


def effects(seeds):
    """Print verdict, size, shrinkage and time of every case and seed."""
    spacecraft = load_spacecraft()
    right = total = 0
    for case in CASES:
        effect = parse_effect(case)
        for seed in range(seeds):
            samples = simulate_setup(inject(spacecraft, [effect], SECONDS), 20_000 + seed)
            begin = time.perf_counter()
            found = diagnose(spacecraft, samples)
            took = time.perf_counter() - begin
            top = found.candidates[0]
            named = effect.name in found.verdict['effects']
            right, total = right + named, total + 1
            key = f'{effect.name}.{effect.size}'
            size = top.parameters.get(key)
            size = f'{size.value:.5g} +- {size.std:.2g}' if size else '-'
            rivals = [c for c in found.candidates if c.built and effect.name not in c.effects]
            rival = max(rivals, key=lambda c: np.nan_to_num(c.closed, nan=-9), default=None)
            rival = f'{"+".join(rival.effects)} {rival.closed:.2f}' if rival else '-'
            print(f'| {effect.text()} | {found.outcome} | {" + ".join(top.effects)} | '
                  f'{found.verdict["probability"]:.2f} | {size} | {top.closed:.2f} | {rival} | '
                  f'{took:.1f} |', flush=True)
    print(f'{right} of {total} named')


if __name__ == '__main__':
    {'null': null, 'effects': effects}[sys.argv[1]](int(sys.argv[2]))
