"""
Square waves on two close pairs: which of their harmonics are called modes of the structure.

    python -m validation.identification_knock
"""
import numpy as np
from ssi_ros.identify import Identification, identify
from ssi_ros.records import Samples
from validation.bench_data import modal_record, RATE_HZ, twin_arrays

NEAR = 0.01             # a structural mode further than that from every true one is invented
PAIRS_HZ = (6.4, 15.84)


def main():
    """Print one line a frequency, and the sums."""
    truth, settings = twin_arrays(), Identification(window_s=60.0, hop_s=10.0)
    t = np.arange(round(60.0 * RATE_HZ)) / RATE_HZ
    windows = invented = missed = 0
    for hz in (0.41, 1.3, 2.345678, 3.7, 3.71, 5.03, 7.77):
        wrong = []
        for seed, size in enumerate((0.5, 3.0, 10.0, 30.0)):
            values = modal_record(truth, 60.0, seed)
            wave = np.sign(np.sin(2.0 * np.pi * hz * t + 0.3)) * size * values.std()
            values += np.outer(wave, [1.0, 0.5, 0.3, 0.8])
            window = identify(Samples(values, RATE_HZ, tuple('abcd')), settings)[-1]
            found = np.array([m.frequency_hz for m in window.modes])
            wrong += [m.frequency_hz for m in window.modes if m.label == 'structural'
                      and np.abs(truth.frequency_hz / m.frequency_hz - 1.0).min() > NEAR]
            missed += sum(np.abs(found / f - 1.0).min() > NEAR for f in PAIRS_HZ)
            windows += 1
        invented += len(wrong)
        print(f'{hz} Hz: called structural {", ".join(f"{f:.2f}" for f in wrong) or "none"}')
    print(f'{windows} windows, {invented} called structural, {missed} of {2 * windows} pairs '
          'missed')


if __name__ == '__main__':
    main()
