"""
Diagnose effects far larger than what a record can just show: two sizes of each of the thirty.

    python -m validation.gap_gross            (all sixty; `FIRST STEP` for a part of them)

Every record: 600 s of the package's own simulator, level within 3 dB of the model's.
"""
import sys
import time

import numpy as np
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.model import load_spacecraft

from validation.gap_reference import at_decibel, CASES, SECONDS

LARGER = (
    'excitation_colour:corner_hz=5', 'harmonic_disturbance:frequency_hz=7.3,torque_n_m=3',
    'wheel_speed_sweep:start_hz=2,end_hz=20,torque_n_m=2',
    'impulsive_events:rate_per_min=10,impulse_n_m_s=0.3',
    'nonstationary_excitation:depth=0.9,period_s=60', 'stiffness_scale:scale=0.8',
    'array_asymmetry:array=E1,scale=0.85', 'damping_scale:scale=3', 'hub_inertia:scale=1.5',
    'added_mass:array=E2,mass_kg=3,along_m=5,lateral_m=-0.4',
    'hinge_compliance:array=E1,stiffness_n_m_rad=2e4',
    'hinge_freeplay:array=E2,gap_rad=2e-5,stiffness_n_m_rad=5e4',
    'hinge_friction:array=E2,torque_n_m=0.2,stiffness_n_m_rad=5e4',
    'cubic_stiffness:array=E1,k3_n_m_rad3=1e14,stiffness_n_m_rad=5e4',
    'stiffness_drift:change=-0.1',
    'fuel_slosh:mass_kg=150,frequency_hz=1.2,damping_ratio=0.01,arm_m=1',
    'attitude_controller:bandwidth_hz=0.2,damping_ratio=0.5',
    'gyroscopic_coupling:momentum_n_m_s=2000', 'sensor_gain:channel=e1_b,scale=1.2',
    'sensor_crosstalk:source=e1_a,channel=e2_b,gain=0.2',
    'sensor_misplacement:channel=e2_a,along_m=-0.5,lateral_m=-0.2',
    'sensor_noise:channel=e2_b,scale=20',
    'sensor_drift:channel=e2_a,rms_m_s2=0.02,time_constant_s=20', 'quantisation:step_m_s2=0.01',
    'saturation:limit_m_s2=0.05', 'sensor_bandwidth:channel=e1_a,corner_hz=15',
    'channel_delay:channel=e2_b,delay_s=0.01', 'clock_rate:ppm=10000',
    'timestamp_jitter:rms_s=0.003', 'dropped_samples:fraction=0.1')
SEED = 70_000


def main(first=0, step=1):
    """Print what is said of every case."""
    spacecraft = load_spacecraft()
    print('| injected | outcome | named | right | of them within 90 % of the truth | CPU s |\n'
          + '|---' * 6 + '|', flush=True)
    for k, case in list(enumerate(CASES + LARGER))[first::step]:
        effect = parse_effect(case)
        craft = at_decibel(spacecraft, np.random.default_rng(k).uniform(-3, 3))
        samples = simulate_setup(inject(craft, [effect], SECONDS), SEED + k)
        begin = time.process_time()
        found = diagnose(spacecraft, samples)
        took = time.process_time() - begin
        named = found.verdict['effects']
        right = ('yes' if named == (effect.name,) else 'in its class'
                 if effect.name in found.verdict['class'] else 'no')
        numbers = found.candidates[0].parameters
        held = [v.low90 <= getattr(effect, name.split('.')[1]) <= v.high90
                for name, v in numbers.items() if name.startswith(effect.name)
                and np.isfinite(v.low90)]
        print(f'| {case} | {found.outcome} | {" + ".join(named)} | {right} | '
              f'{sum(held)} of {len(held)} | {took:.0f} |', flush=True)


if __name__ == '__main__':
    main(*map(int, sys.argv[1:]))
