"""
Detectors: tests of single effects, each by what it alone leaves in a record.

Every file registers its detectors for their effects when it is imported here; an effect of another
package registers its own. What they find is a `Detection`.
"""
from ssi_ros.effects import effect_class
from ssi_ros.effects.places import offered
from ssi_ros.effects.registry import detectors
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors import (  # noqa: F401 (they register themselves)
    amplitude_modulation, chirp, impulses, low_frequency_noise, samples as of_samples,
    tone)
from ssi_ros.open_set.families import FAMILIES, findings
from ssi_ros.open_set.force_between import FAMILIES as OF_FORCES
from ssi_ros.open_set.spectra import record_spectra

ANOMALIES = 'line', 'spikes', *FAMILIES, *OF_FORCES      # all, by their bases
OF_NO_EFFECT = 4        # tests: lines, spikes, odd channels, unmodelled changes
EDGES = 2               # tapers from both ends of a record in which nothing is asked


def detect_in_samples(samples, names):
    """Return the detections in the samples themselves, of the effects named, the latest first."""
    # the library goes from the excitation to the recorder; what happened last is undone first
    return _detect('samples', names, samples)[::-1]


def detect_in_input(reconstruction, names):
    """Return the detections in the reconstructed input, of the effects named."""
    return _detect('input', names, reconstruction)


def detect_in_spectrum(simulator, fitted, samples, settings, names):
    """Return the detections in the spectrum of the whole record, of the effects named."""
    return _detect('spectrum', names, simulator, fitted, samples, settings)


def anomalies(reconstruction, channels, asked=ANOMALIES):
    """Return lines and spikes that no input explains; of one channel any input explains all."""
    if len(channels) < 2:
        return ()
    found = [tone.anomalous_line(reconstruction)] if 'line' in asked else []
    if 'spikes' in asked:
        found += [impulses.anomalous_spikes(reconstruction, c, i) for i, c in enumerate(channels)]
    return tuple(d for d in found if d is not None)


def open_set(simulator, fitted, reconstruction, channels, asked=ANOMALIES):
    """Return findings of families of the open-set test, probable ones too; basis is the family."""
    # its families are calibrated on spacecraft, whose modes are fast beside the record
    if not FAMILIES.keys() & asked or 'geometry' not in offered(simulator.spacecraft):
        return ()
    setup = simulator.setup(fitted.candidate, fitted.levels)
    record = record_spectra(setup.system, fitted.levels, reconstruction, channels)
    return tuple(Detection('', {}, f.p_value, f.text, basis=f.family) for f in findings(
        record, reconstruction.values, reconstruction.recorded,
        EDGES * reconstruction.inside.start / record.rows, asked))


def tests_of(names):
    """Return how many tests search one record for the effects named, and for what none makes."""
    return OF_NO_EFFECT + sum(
        name in names for of in ('samples', 'input', 'spectrum') for name in detectors(of))


def _detect(of, names, *arguments):
    found = [detector(effect_class(name), *arguments)
             for name, detector in detectors(of).items() if name in names]
    return tuple(d for d in found if d is not None)
