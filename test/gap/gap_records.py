"""Records with effects, and the model fitted to them, for the tests of signs and of holes."""
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.whittle import Evidence
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame, spectra
from ssi_ros.model import load_spacecraft

SETTINGS = DiagnosisSettings()


def record(seconds, effects=(), seed=3, known=()):
    """Return a record with effects, and the model side, which knows some of them."""
    spacecraft = load_spacecraft()
    samples = simulate_setup(inject(spacecraft, effects, seconds), seed)
    frame = make_frame(len(samples.values), 100.0, SETTINGS)
    return samples, Simulator(spacecraft, frame, seconds, known)


def evidence_of(simulator, samples):
    """Return all pieces of a record in the frame of a model side."""
    frame = simulator.frame
    return Evidence(frame, spectra(samples, frame), tuple(range(frame.segments)))


def look(sign, seconds, texts, seed=3, known=()):
    """Return what a detector, or `reconstruct`, makes of a record, some of its effects known."""
    samples, simulator = record(seconds, [parse_effect(t) for t in texts], seed, known)
    return sign(simulator, fit(simulator, evidence_of(simulator, samples)), samples, SETTINGS)
