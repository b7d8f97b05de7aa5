"""
Measure the live gap meter: false alarms, delay from effect to alarm, cost of an update.

`python -m validation.gap_live false HOURS [SEED]`, `... delay [SEEDS]`, `... cost`, `... levels`;
the tables are those of docs/validation/gap_live.md.
"""
import sys
import time

import numpy as np
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.effects.stream import stream_setup
from ssi_ros.gap.online.calibration import LiveSettings, prepare
from ssi_ros.gap.online.e_detector import quiet, step
from ssi_ros.gap.online.sliding import LiveGap
from ssi_ros.model import load_spacecraft

DECLARED_S = (3600.0, 4 * 3600.0, 24 * 3600.0, 30 * 86400.0)
CASES = (
    'sensor_gain:channel=e1_a,scale=1.01', 'sensor_gain:channel=e1_a,scale=1.05',
    'array_asymmetry:array=E1,scale=0.997', 'array_asymmetry:array=E1,scale=0.98',
    'stiffness_scale:scale=0.998', 'damping_scale:scale=1.25', 'damping_scale:scale=2',
    'hub_inertia:scale=1.08', 'channel_delay:channel=e1_b,delay_s=0.0004',
    'clock_rate:ppm=1500', 'excitation_colour:corner_hz=100', 'excitation_colour:corner_hz=30',
    'harmonic_disturbance:frequency_hz=12,torque_n_m=0.02',
    'harmonic_disturbance:frequency_hz=12,torque_n_m=0.3',
    'hinge_freeplay:array=E1,gap_rad=1e-5,stiffness_n_m_rad=1e5',
    'sensor_noise:channel=e2_a,scale=2', 'quantisation:step_m_s2=0.01',
    'saturation:limit_m_s2=0.1', 'impulsive_events:rate_per_min=6,impulse_n_m_s=0.05')
BEFORE_S, AFTER_S = 900.0, 3600.0


class Several(LiveGap):
    """The live meter with one alarm for each of several declared rates, begun anew when raised."""

    def __init__(self, *args):
        super().__init__(*args)
        self.alarms = {s: quiet(self.model.bank) for s in DECLARED_S}
        self.counts = dict.fromkeys(DECLARED_S, 0)
        self.causes, self.kept = [], None

    def _fit(self):
        """Fit the levels once a window: they are those of the simulation all the time."""
        if self.kept is None or self.hop % self.window.maxlen == 0:
            self.kept = super()._fit()
        return self.kept

    def _update(self, found, reasons):
        """Measure once a window: windows that share no hop."""
        return super()._update(found, reasons) if self.hop % self.window.maxlen == 0 else None

    def _score(self, found):
        statistics = super()._score(found)
        for declared_s, alarm in self.alarms.items():
            threshold = np.log(declared_s * self.rate_hz / self.rows)
            alarm = step(alarm, self.model.bank, statistics, threshold, self._stamp(self.hop))
            if alarm.raised_ns is not None:
                self.counts[declared_s] += 1
                self.causes.append((declared_s, self.model.cause(alarm.statistic)))
                alarm = quiet(self.model.bank)
            self.alarms[declared_s] = alarm
        return statistics


def false_alarms(hours, seed):
    """Simulate the model itself and count alarms at several declared rates."""
    spacecraft, settings = load_spacecraft(), LiveSettings()
    live = Several(prepare(spacecraft, settings), [s.name for s in spacecraft.sensors], 0,
                   settings)
    _, _, blocks = stream_setup(spacecraft, (), seed, block_s=settings.hop_s)
    deviations = []
    for _ in range(round(hours * 3600 / settings.hop_s)):
        deviations += [u.deviations for u in live.push(next(blocks).values) if u is not None]
    print(f'{hours:g} h, seed {seed}, hop {settings.hop_s:g} s, window {settings.window_s:g} s')
    print('| declared: one in | allowed in this time | seen |\n|---|---|---|')
    for declared_s, count in live.counts.items():
        print(f'| {declared_s / 3600:g} h | {hours * 3600 / declared_s:.1f} | {count} |')
    print('causes:', live.causes)
    window = np.array(deviations)
    print(f'meter: {window.mean():+.2f} +- {window.std():.2f} sd over {len(window)} windows that '
          'share no hop')


def delays(seeds):
    """Inject each case after BEFORE_S and measure the time to the alarm."""
    spacecraft, settings = load_spacecraft(), LiveSettings()
    model = prepare(spacecraft, settings)
    print('| effect | delay to the alarm [s], by seed | cause | leading after 600 s |\n'
          '|---|---|---|---|')
    for text in CASES:
        row, causes, leading = [], [], []
        for seed in range(1, seeds + 1):
            live = LiveGap(model, [s.name for s in spacecraft.sensors], 0, settings)
            # the effect begins with a hop, so that no piece holds the seam of the two records
            live.push(simulate_setup(inject(spacecraft, (), BEFORE_S), 100 + seed).values)
            record = simulate_setup(inject(spacecraft, [parse_effect(text)], AFTER_S), 200 + seed)
            updates = live.push(record.values)
            raised = updates[-1].raised_ns
            row.append('none' if raised is None else f'{raised * 1e-9 - BEFORE_S:.0f}')
            causes.append(updates[-1].cause or '-')
            leading.append(updates[round(600.0 / settings.hop_s) - 1].leading)
        print(f'| {text} | {", ".join(row)} | {", ".join(dict.fromkeys(causes))} | '
              f'{", ".join(dict.fromkeys(leading))} |', flush=True)


def levels():
    """Count alarms in 2 h where only the nuisances are off: excitation and noise level, gains."""
    spacecraft, settings = load_spacecraft(), LiveSettings()
    model = prepare(spacecraft, settings)
    for texts in (('sensor_noise:channel=e1_a,scale=1.2', 'sensor_noise:channel=e1_b,scale=1.2',
                   'sensor_noise:channel=e2_a,scale=1.2', 'sensor_noise:channel=e2_b,scale=1.2'),
                  ('sensor_gain:channel=e1_a,scale=1.0002',), ('stiffness_scale:scale=1.0001',)):
        live = LiveGap(model, [s.name for s in spacecraft.sensors], 0, settings)
        effects = [parse_effect(t) for t in texts]
        last = live.push(simulate_setup(inject(spacecraft, effects, 7200.0), 5).values)[-1]
        print(' '.join(texts), '->', last.cause or 'no alarm', f'level {last.alarm_level:.1f}')


def cost():
    """Time one update, complete rows and with one of a hundred rows missing."""
    spacecraft, settings = load_spacecraft(), LiveSettings()
    began = time.process_time()
    model = prepare(spacecraft, settings)
    print(f'prepare: {time.process_time() - began:.1f} s')
    for text in ('sensor_gain:scale=1.0', 'dropped_samples:fraction=0.01'):
        record = simulate_setup(inject(spacecraft, [parse_effect(text)], 1800.0), 3)
        live = LiveGap(model, record.channels, 0, settings)
        live.push(record.values[:90000])
        began = time.process_time()
        count = len(live.push(record.values[90000:]))
        spent = (time.process_time() - began) / count
        print(f'{text}: {1e3 * spent:.0f} ms an update of {settings.hop_s:g} s, '
              f'{100 * spent / settings.hop_s:.2f} % of a core')


if __name__ == '__main__':
    verb, *rest = sys.argv[1:]
    {'false': lambda h='10', s='1': false_alarms(float(h), int(s)),
     'delay': lambda n='3': delays(int(n)), 'cost': cost, 'levels': levels}[verb](*rest)
