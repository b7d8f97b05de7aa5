"""How long should the window be? Longer is sharper, but later: examples/tune_a_window.py."""
import numpy as np

from ssi_ros.bag import read_channels
from ssi_ros.identify import Identification, identify
from ssi_ros.model import assemble, load_spacecraft, natural_modes
from ssi_ros.report.samples import samples_of

samples = samples_of(read_channels('bags/ambient'))
theory = natural_modes(assemble(load_spacecraft('config/spacecraft.yaml')))
print('window [s]  modes  off [%]  its spread [%]  damping off [%]  lowest mode [Hz]')
for window_s in (15.0, 30.0, 60.0, 140.0):
    part = samples.between(0.0, window_s)
    modes = identify(part, Identification(window_s=window_s, hop_s=window_s / 20))[-1].modes
    f = np.array([m.frequency_hz for m in modes])
    nearest = np.abs(f[:, None] - theory.frequencies_hz).argmin(axis=1)
    off = np.abs(f / theory.frequencies_hz[nearest] - 1)
    spread = np.array([m.frequency_std_hz for m in modes]) / f
    damping = np.array([m.damping_ratio for m in modes]) / theory.damping_ratios[nearest] - 1
    print(f'{window_s:10.0f} {len(modes):6d} {100 * np.median(off):8.3f} '
          f'{100 * np.nanmedian(spread):15.3f} {100 * np.median(np.abs(damping)):16.0f} '
          f'{f.min():17.3f}')
