"""The model side of a diagnosis: expected spectra of candidates, levels of the excitation."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import inject
from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.inference.whittle import Evidence, whiten
from ssi_ros.gap.spectra.expected_periodogram import expected
from ssi_ros.gap.spectra.jitter_noise import jitter_noise_of, scans_of
from ssi_ros.gap.spectra.segmentation import spectra
from ssi_ros.model.excitation import source, White
from ssi_ros.weighted_sums import few_of

# What a candidate raises that cannot exist, as a mass off the array does.
IMPOSSIBLE = (ValueError, np.linalg.LinAlgError, OverflowError)


@dataclass(frozen=True, eq=False)
class Simulator:
    """
    Expected periodograms of candidates on a spacecraft, in a frame.

    `present` are effects that the model has already, `jitter_noise` the noise that jitter makes
    of the motion of one record, see `with_motion_of`; `compensation`, a Compensation, keeps the
    modes of candidates where the record has them; `recorded`, RecordedInputs, come before the
    channels; `late` is that of the Samples.
    """

    spacecraft: object
    frame: object
    duration_s: float
    present: tuple = ()
    jitter_noise: object = None
    compensation: object = None
    recorded: object = None
    late: tuple = ()

    def on(self, frame):
        """Return the same model side in another frame."""
        return self.but(frame=frame, jitter_noise=None)

    def but(self, **changes):
        """Return the same model side with some of its parts replaced."""
        return replace(self, **changes)

    @property
    def known(self):
        """Return how many channels, the first ones, are recorded inputs."""
        return self.recorded.count if self.recorded and self.recorded.first else 0

    def evidence(self, samples):
        """Return the Evidence of Samples cut by the frame."""
        frame = self.frame
        return Evidence(frame, spectra(samples, frame), frame.used, known=self.known)

    @property
    def moved(self):
        """Return the model as all its inputs move it, for sizes to begin at."""
        return self.recorded.moving(self.spacecraft) if self.recorded else self.spacecraft

    def of_inputs(self, **changes):
        """Return the same model side with other recorded inputs, or the same without any."""
        return self.but(recorded=replace(self.recorded, **changes)) if self.recorded else self

    def for_templates(self, levels):
        """Return the model side that templates for a record at levels are made by."""
        # what recorded inputs drive does not follow the levels
        return self.of_inputs(exact=False).but(
            spacecraft=at_levels(self.spacecraft, levels)) if self.recorded else self

    def at_errors(self, values):
        """Return the same model side with the errors of its numbers at values, (m,)."""
        return self.but(spacecraft=self.spacecraft.at_errors(values))

    def shift(self, candidate):
        """Return by what a candidate moves the errors of the model, (m,), or 0."""
        return self.compensation.shift(candidate) if self.compensation else 0.0

    def with_motion_of(self, evidence, candidate, levels):
        """Return the model side whose jitter noise is of the motion of a record, eq. (95b)."""
        if self.jitter_noise is not None or self.recorded:
            return self
        try:
            setup = self.setup(candidate, levels)
            if not setup.jitter_rms_s:
                return self
            levels = np.ones(len(self.spectrum(setup).names)) if levels is None else levels
            sides = [self.but(jitter_noise=jitter_noise_of(self, setup, levels, evidence, scan))
                     for scan in scans_of(self.late)]
            return sides[0] if len(sides) < 2 else max(sides, key=lambda side: whiten(
                side.spectrum(setup).at(levels), evidence).likelihood)
        except IMPOSSIBLE:
            return self

    def setup(self, candidate, levels=None, near=None):
        """Return the setup of a candidate beside what is present, its hinges excited at levels."""
        # `near` is that of the expected periodograms of a candidate like it
        spacecraft, shift = self.spacecraft, self.shift(candidate)
        if np.any(shift):
            spacecraft = spacecraft.at_errors(np.array(spacecraft.calibration.values) + shift)
        found = self.injected(spacecraft, candidate)
        if levels is None or not found.laws:
            return found
        names = [p.name for p in found.system.excitation
                 if isinstance(source(p), White) and source(p).free]
        return replace(found, powers=dict(zip(names, levels)), near=near)

    def injected(self, spacecraft, candidate):
        """Return the setup of a candidate on a spacecraft, beside what is present."""
        found = inject(spacecraft, tuple(self.present) + candidate.effects, self.duration_s)
        return replace(found, late=self.late) if self.late else found

    def expected(self, candidate, levels=None, near=None):
        """Return its expected periodograms; None where it cannot exist, as off the array."""
        try:
            found = self.spectrum(self.setup(candidate, levels, near))
        except IMPOSSIBLE:
            return None
        finite = all(np.all(np.isfinite(few_of(p))) for p in (*found.held, found.fixed))
        return found if finite else None

    def expected_there(self, candidate, levels=None):
        """Return its expected periodograms; ValueError where it cannot exist."""
        found = self.expected(candidate, levels)
        if found is None:
            raise ValueError(f'the model cannot exist with {candidate.names or "these errors"}')
        return found

    def spectrum(self, setup):
        """Return the expected periodograms of a setup."""
        return expected(setup, self.frame, self.jitter_noise,
                        self.recorded and self.recorded.expected)


def at_levels(spacecraft, levels):
    """Return a spacecraft whose torque, process noise and sensor noise have levels of power."""
    if hasattr(spacecraft, 'at_levels'):        # a model of somebody else, with inputs of its own
        return spacecraft.at_levels(levels)
    *torques, process, noise = np.sqrt(levels)
    excitation = spacecraft.excitation
    # one level for all axes, or one for each that is driven
    each = iter(torques * 3 if len(torques) == 1 else torques)
    return replace(
        spacecraft, noise_rms_m_s2=spacecraft.noise_rms_m_s2 * float(noise),
        excitation=replace(
            excitation, process_noise_rms=excitation.process_noise_rms * float(process),
            torque_rms_n_m=tuple(float(t * next(each)) if t or len(torques) == 1 else 0.0
                                 for t in excitation.torque_rms_n_m)))


def level_prior(count):
    """Return the precision of the logarithms of so many levels, the sensor noise last."""
    stds = np.append(np.full(count - 1, LIMITS.excitation_std.value), LIMITS.noise_std.value)
    return 1 / stds ** 2


def implausible_levels(levels):
    """Return what is wrong with levels that no nuisance reaches, or an empty text."""
    decibels = 10 * np.log10(levels)
    excitation, noise = decibels[:-1].max(), decibels[-1]
    if max(excitation, noise) < LIMITS.quiet_db.value:
        return (f'excitation and noise are both {-max(excitation, noise):.0f} dB and more below '
                'the model: are the samples in g and not in m/s^2?')
    if abs(excitation) > LIMITS.excitation_db.value:
        return f'the excitation is {excitation:+.0f} dB off the model: wrong unit or wrong model?'
    if noise > LIMITS.noise_db.value:
        return (f'noise on all channels is {noise:+.0f} dB above the model and hides it: wrong '
                'unit, or no accelerometer?')
    return ''
