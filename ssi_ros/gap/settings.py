"""What the engineer may set about a diagnosis; every default works untouched."""
from dataclasses import dataclass

from ssi_ros.quantity import (  # noqa: F401 (Threshold: for the limits of the package)
    check, from_mapping, quantity, Threshold)


@dataclass(frozen=True)
class DiagnosisSettings:
    """Settings of the gap meter and of the search for its cause."""

    segment_s: float = quantity(60.0, unit='s', low=1.0, high=86400.0,
                                doc='length of the segments that spectra are estimated from')
    least_segments: int = quantity(8, low=4, high=1000,
                                   doc='a short record is cut into this many shorter segments')
    low_hz: float = quantity(0.1, unit='Hz', low=0.0, high=1e4, doc='lowest frequency used')
    high_share: float = quantity(0.98, low=0.05, high=1.0,
                                 doc='highest frequency used, as a share of half of the rate')
    band_bins: int = quantity(8, low=1, high=1000,
                              doc='frequency bins in a band of the gap statistic')
    false_alarm: float = quantity(0.08, low=1e-6, high=0.5,
                                  doc='p-value below which a cause is searched')
    gain_std: float = quantity(1.2e-4, low=0.0, high=1.0,
                               doc='standard deviation of the relative error of each gain')
    stiffness_std: float = quantity(6e-5, low=0.0, high=1.0,
                                    doc='standard deviation of the relative error of the '
                                        'stiffness of an array')
    frequency_std: float = quantity(5e-5, low=0.0, high=1.0,
                                    doc='standard deviation of the relative error of each '
                                        'clamped frequency')
    dispersion_std: float = quantity(1e-4, low=0.0, high=1.0,
                                     doc='relative error of the highest frequency by mesh or '
                                         'integrator')
    finalists: int = quantity(9, low=1, high=30,
                              doc='number of effects that are fitted after the score test')
    temperature: float = quantity(1.0, low=0.1, high=100.0,
                                  doc='divides the logarithms of the posterior odds')
    tie_cosine: float = quantity(0.95, low=0.5, high=1.0,
                                 doc='cosine of scores above which effects are one class')
    prior_none: float = quantity(0.25, low=1e-6, high=1.0,
                                 doc='prior probability that nothing is wrong')
    prior_single: float = quantity(0.5, low=1e-6, high=1.0,
                                   doc='prior probability of one effect of the library')
    prior_pair: float = quantity(0.12, low=1e-6, high=1.0,
                                 doc='prior probability of two of them at once')
    prior_unknown: float = quantity(0.13, low=1e-6, high=1.0,
                                    doc='prior probability of something outside the library')

    def __post_init__(self):
        check(self)
        total = self.prior_none + self.prior_single + self.prior_pair + self.prior_unknown
        if abs(total - 1) > 1e-6:
            raise ValueError(f'prior_none + prior_single + prior_pair + prior_unknown = '
                             f'{total:g}; prior probabilities add up to 1')


def load_settings(path=None):
    """Read the settings from YAML; None gives the defaults. ValueError names a wrong key."""
    from ssi_ros.plain_yaml import read_plain
    if path is None:
        return DiagnosisSettings()
    return from_mapping(DiagnosisSettings, read_plain(path) or {}, f'{path}: ')
