"""
Identify BridgeData.mat (E. Cheynet, github.com/ECheynet/SSICOV) with the defaults.

    SSI_ROS_DATA=FOLDER python validation/identification_bridge.py
"""
import os
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from ssi_ros.identify import Identification, identify
from ssi_ros.records import Samples

RATE_HZ = 15.0


def main():
    """Print the true frequencies, those of the average-acceleration rule, and the modes."""
    data = loadmat(Path(os.environ.get('SSI_ROS_DATA', 'data')) / 'BridgeData.mat')
    omega = np.sort(np.ravel(data['wn']))
    rule = 2.0 * RATE_HZ * np.arctan(omega / (2.0 * RATE_HZ))
    for name, values in (('true', omega), ('average acceleration', rule)):
        print(f'{name} [Hz]:', *(f'{v / (2.0 * np.pi):.4f}' for v in values))
    rows = np.asarray(data['rz'], float)
    rows = rows.T if rows.shape[0] < rows.shape[1] else rows
    samples = Samples(rows, RATE_HZ, tuple('abcde'))
    settings = Identification(window_s=3600.0, hop_s=3600.0)
    for mode in identify(samples, settings)[0].modes:
        print(f'{mode.frequency_hz:.4f} Hz, {100 * mode.damping_ratio:.2f} %, {mode.label}')


if __name__ == '__main__':
    main()
