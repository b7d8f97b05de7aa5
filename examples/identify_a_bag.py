"""Identify the modes of a bag: python examples/identify_a_bag.py [BAG]."""
import sys

from ssi_ros.bag import read_channels
from ssi_ros.identify import Identification, identify
from ssi_ros.report.samples import samples_of

bag = sys.argv[1] if len(sys.argv) > 1 else 'bags/ambient'
samples = samples_of(read_channels(bag))
for window in identify(samples, Identification(window_s=120.0, hop_s=10.0)):
    print(f'{len(window.modes)} modes {window.reason}')
    for m in window.modes:
        print(f'  {m.frequency_hz:8.4f} +- {m.frequency_std_hz:.4f} Hz   '
              f'{100 * m.damping_ratio:5.2f} +- {100 * m.damping_ratio_std:.2f} %   {m.label}')
