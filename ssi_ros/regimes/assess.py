"""The Regime of two recordings that were brought together."""
import numpy as np

from ssi_ros.events.single import carrier_rows
from ssi_ros.gap.nominal.periodic.period import autocorrelation
from ssi_ros.regimes.common_drive import drive_evidence
from ssi_ros.regimes.decays import vibration
from ssi_ros.regimes.excess import excess_of
from ssi_ros.regimes.regime import of_carrier, of_drive, of_transients, Regime
from ssi_ros.regimes.thresholds import LIMITS


def regime_of(recordings):
    """Return the Regime of a `Recordings`."""
    both = recordings.clean.reference, recordings.clean.record
    rate_hz, cut = recordings.clean.rate_hz, recordings.full_cut
    found = [vibration(v, rate_hz) for v in both]
    if _one_carrier(both, found):
        powers = [np.square(v - v.mean(axis=0)).mean(axis=0) for v in both]
        level = float(np.median(10 * np.log10(powers[1] / powers[0])))
        return of_carrier(level * (abs(level) > LIMITS.other_level_db.value))
    transient = of_transients(*found, cut.ends_hz[0] + cut.width_hz)
    if transient is not None:
        return transient
    if recordings.enough_periods:
        return of_drive(drive_evidence(*recordings.repeats), excess_of(
            recordings.repeats, recordings.null.prediction.mean, recordings.nominal.cut))
    return Regime()


def _one_carrier(both, found):
    """Return whether both are a vibration of one period that neither grows nor falls."""
    if any(v.varies_db > LIMITS.steady_db.value for v in found):
        return False
    periods = [carrier_rows(autocorrelation(v)) for v in both]
    return None not in periods and abs(periods[1] / periods[0] - 1) < LIMITS.same_carrier.value
