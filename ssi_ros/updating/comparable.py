"""Whether a record can be compared with a model at all, and what a user is to know of both."""
from dataclasses import dataclass

from ssi_ros.effects import left_out
from ssi_ros.gap.detectors.data_faults import faults_beside_model
from ssi_ros.gap.nominal.simulator import implausible_levels
from ssi_ros.integrity.fault import as_reason


@dataclass(frozen=True)
class Comparable:
    """Notes on a record and a model, and what is in the way of a comparison."""

    notes: tuple            # what was left out or changed, in sentences
    mismatch: str           # why they cannot be compared; empty if they can
    doubtful: bool          # whether a scan of the channels alone is why


def comparable(simulator, record, fitted, levels):
    """
    Return whether a Record and a model can be compared.

    Parameters
    ----------
    simulator : Simulator
        The model.
    record : Record
        With the faults that its samples show.
    fitted : Fit
        Of the levels alone.
    levels : ndarray
        Powers over nominal that the record was made ready with.

    Returns
    -------
    Comparable

    """
    craft = simulator.spacecraft
    faults = record.faults + faults_beside_model(simulator, fitted, record.spectra)
    notes = record.notes + left_out(craft) + tuple(
        f'not in the calibrated model: {t}' for t in craft.calibration.unexplained)
    mismatch = as_reason(faults) or ('' if record.detections else implausible_levels(levels))
    return Comparable(notes + tuple(f.text for f in faults), mismatch,
                      bool(mismatch) and {f.kind for f in faults} <= {'scan skew'})
