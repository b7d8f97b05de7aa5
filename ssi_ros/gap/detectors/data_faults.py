"""Faults of the data, which no effect makes: what wiring and recorder did to the channels."""
from ssi_ros.gap.candidate import Candidate
from ssi_ros.inputs.beside import unpredicted
from ssi_ros.integrity.repeats import faults_of_samples
from ssi_ros.integrity.wiring import CrossSpectra, faults_of_spectra


def faults_beside_model(simulator, fitted, evidence):
    """Return Faults in the cross-spectra of an Evidence, with the levels alone fitted to it."""
    nominal, fitted, evidence = unpredicted(
        simulator, fitted, evidence) if simulator.recorded else (
        simulator.expected(Candidate()).at_nominal.mean(axis=0), fitted.plain.mean(axis=0),
        evidence)
    return faults_of_spectra(CrossSpectra(
        tuple(s.name for s in simulator.spacecraft.sensors), evidence.frame.frequencies_hz,
        nominal, fitted, evidence.mean[0], len(evidence.segments) / evidence.frame.inflation))


def faults_beside_recording(reference, record, recordings):
    """Return Faults of a record (Samples) that a reference does not have."""
    known = {(f.kind, c) for f in faults_of_samples(reference) for c in f.sizes}
    found = [f for f in faults_of_samples(record) if not {(f.kind, c) for c in f.sizes} <= known]
    if recordings.regime.unsteady:
        # a motion that dies away has no scatter to judge cross-spectra by
        return tuple(found)
    # as they were recorded: levels that are freed would take up a part of the fault
    one, two = recordings.pair.spectra(recordings.full_cut)
    return (*found, *faults_of_spectra(CrossSpectra(
        recordings.pair.channels, one.cut.middles_hz, one.mean, one.mean, two.mean,
        one.freedom * two.freedom / (one.freedom + two.freedom), measured=True)))
