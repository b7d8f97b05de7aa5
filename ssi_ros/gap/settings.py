"""What the engineer may set about a diagnosis; every default works untouched."""
from dataclasses import dataclass

from ssi_ros.quantity import check, from_mapping, quantity


@dataclass(frozen=True)
class DiagnosisSettings:
    """Settings of the gap meter and of the search for its cause."""

    segment_s: float = quantity(60.0, unit='s', low=1.0, high=86400.0,
                                doc='length of the pieces that spectra are taken of')
    least_segments: int = quantity(8, low=4, high=1000,
                                   doc='a short record is cut into so many, shorter ones')
    low_hz: float = quantity(0.1, unit='Hz', low=0.0, high=1e4, doc='lowest frequency used')
    high_share: float = quantity(0.98, low=0.05, high=1.0,
                                 doc='highest frequency used, as a share of half of the rate')
    band_bins: int = quantity(8, low=1, high=1000, doc='frequency bins of a band of the meter')
    false_alarm: float = quantity(0.08, low=1e-6, high=0.5,
                                  doc='p-value below which a cause is looked for')
    gain_std: float = quantity(1.2e-4, low=0.0, high=1.0,
                               doc='how exactly gains are known, standard deviation')
    stiffness_std: float = quantity(6e-5, low=0.0, high=1.0,
                                    doc='how exactly the stiffness of an array is known')
    frequency_std: float = quantity(5e-5, low=0.0, high=1.0,
                                    doc='how exactly each frequency of a clamped array is known')
    dispersion_std: float = quantity(1e-4, low=0.0, high=1.0,
                                     doc='error of the highest frequency by mesh or integrator')
    finalists: int = quantity(9, low=1, high=30, doc='effects fitted after the scores')
    temperature: float = quantity(1.0, low=0.1, high=100.0,
                                  doc='divides the logarithms of probabilities')
    tie_cosine: float = quantity(0.95, low=0.5, high=1.0,
                                 doc='effects whose scores correlate more are one class')

    def __post_init__(self):
        check(self)


def load_settings(path=None):
    """Read the settings from YAML; None gives the defaults. ValueError names a wrong key."""
    import yaml
    if path is None:
        return DiagnosisSettings()
    with open(path) as file:
        return from_mapping(DiagnosisSettings, yaml.safe_load(file) or {}, f'{path}: ')
