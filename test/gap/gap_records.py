"""Records with effects, and the model fitted to them, for the tests of signs."""
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.fit import fit, Simulator
from ssi_ros.gap.likelihood import Evidence
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import make_frame, spectra
from ssi_ros.model import load_spacecraft

SETTINGS = DiagnosisSettings()


def look(sign, seconds, texts, seed=3, known=()):
    """Return what `reconstruct` or `slow_signs` makes of a record, some of its effects known."""
    spacecraft = load_spacecraft()
    samples = simulate_setup(inject(spacecraft, [parse_effect(t) for t in texts], seconds), seed)
    frame = make_frame(len(samples.values), 100.0, SETTINGS)
    simulator = Simulator(spacecraft, frame, seconds, known)
    evidence = Evidence(frame, spectra(samples, frame), tuple(range(frame.pieces)))
    return sign(simulator, fit(simulator, evidence), samples, SETTINGS)
