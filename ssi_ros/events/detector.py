"""A single event as a detection that the diagnosis against a recording has."""
import numpy as np

from ssi_ros.events.single import single_event
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.candidate import Form
from ssi_ros.gap.nominal.periodic.period import autocorrelation


def event_in(effect, recordings):
    """Return the Detection of a single event in a periodic record, or None."""
    clean = recordings.clean
    found = single_event(clean.reference, clean.record, autocorrelation)
    if found is None:
        return None
    row, size, p_value = found
    at_s = row / clean.rate_hz
    time_s = recordings.delay_s + at_s
    return Detection(
        effect.name, {'rate_per_min': 60 * clean.rate_hz / len(clean.record)}, p_value,
        f'a single event at {time_s:.2f} s, {size:.0f} standard deviations from the period before '
        'and after', times=(np.array([time_s]), np.ones(1)),
        basis=lambda r: (_without(r, at_s),))


def _without(recordings, at_s):
    """Return the form of an event: the record without the groups that it is in."""
    two = recordings.two
    half_s = two.weights * two.cut.rows / two.cut.rate_hz / 2
    inside = np.abs(two.times_s - at_s) < 1.5 * half_s
    return Form({}, (), masked=np.repeat(inside[:, None], two.cut.bands, axis=1))
