"""One page of a recording: what was measured, identified, and how it compares with a model."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.identify import Identification, identify
from ssi_ros.model import assemble
from ssi_ros.report.before_after import pair
from ssi_ros.report.curves import density, record_periodograms
from ssi_ros.report.diagnosis_sections import diagnosis_sections, summary
from ssi_ros.report.mode_pictures import (
    close_modes, mode_table, notes, shape_table, stabilisation, tracks)
from ssi_ros.report.mode_words import modes_sentence
from ssi_ros.report.page import page
from ssi_ros.report.parts import percent, Section, Table
from ssi_ros.report.record_pictures import histories, spectra
from ssi_ros.report.spacecraft_3d import shapes_picture

WINDOWS = 20            # results of the sliding window, by default
SHARE = 0.5             # of the record in one window, by default


@dataclass(frozen=True, eq=False)
class Judged:
    """A model, the diagnosis of the record against it, and its curves."""

    spacecraft: object
    diagnosis: object
    view: object
    model: str


def windows_of(samples, window_s=0.0, hop_s=0.0):
    """
    Identify on sliding windows; by default half of the record, in twenty steps.

    Returns
    -------
    tuple of WindowModes

    """
    if not window_s:
        hop_s = hop_s or max(int(100 * samples.duration_s * (1 - SHARE) / WINDOWS) / 100, 0.01)
        window_s = hop_s * max(1, int(samples.duration_s * SHARE / hop_s))
    elif not hop_s:
        # a whole fraction of the window, near the one that makes WINDOWS of the record
        wanted_s = max(samples.duration_s - window_s, window_s) / WINDOWS
        hop_s = window_s / max(1, round(window_s / wanted_s))
    return identify(samples, Identification(window_s=window_s, hop_s=hop_s))


def bag_page(name, samples, windows, *, facts=(), judged=None):
    """
    Return the page.

    Parameters
    ----------
    name : str
        Of the bag.
    samples : Samples
        On an even grid.
    windows : sequence of WindowModes
        Identified; the last one is shown in detail.
    facts : sequence of (str, str)
        What else to say of the bag.
    judged : Judged, optional
        With it spectra, modes and shapes are compared with a model.

    Returns
    -------
    str

    """
    last, system, pairs = windows[-1], None, None
    if judged is not None:
        system = assemble(judged.spacecraft)
        pairs = pair(last.modes, system)
    sections = [_modes(samples, last, pairs), _recorded(samples, facts),
                *_spectra(samples, judged)]
    if judged is not None:
        drawn = (shapes_picture(judged.spacecraft, system, pairs),
                 ) if judged.spacecraft.arrays else ()
        sections.append(Section('Which shapes have the modes?', (), (), (
            *drawn, *_shapes(last, samples))))
    elif last.modes:
        sections.append(Section(
            'Which shapes have the modes?', (
                'Without --model there is no spacecraft to draw them on.',), (),
            _shapes(last, samples)))
    if any(w.modes for w in windows):
        sections.append(Section('Do they stay?', _length(windows), (), (
            tracks(windows, 'frequency'), tracks(windows, 'damping'))))
    text = modes_sentence(windows)
    if judged is not None and judged.diagnosis is not None:
        found = judged.diagnosis.to_json()
        text += ' ' + summary(found)
        sections += diagnosis_sections(found, judged.view, bag=name,
                                       nominal=f'--model {judged.model}')
    return page(f'Report of {name}', text, sections)


def _recorded(samples, facts):
    missing = np.isnan(samples.values)
    rows = [('length', f'{samples.duration_s:g} s, {len(samples.values)} samples at '
             f'{samples.rate_hz:g} Hz'), *facts]
    with np.errstate(invalid='ignore'):
        channels = [(name, f'{1e3 * np.nanstd(v):#.4g}', f'{1e3 * np.nanmax(np.abs(v)):#.4g}',
                     percent(float(m.mean()), 2))
                    for name, v, m in zip(samples.channels, samples.values.T, missing.T)
                    if not m.all()]
    return Section('What was recorded?', (), (
        Table(('of the bag', ''), tuple(rows)),
        Table(('channel', 'rms [mm/s²]', 'largest [mm/s²]', 'missing'), tuple(channels))),
        (histories(samples),))


def _spectra(samples, judged):
    if judged is not None and judged.view is not None:
        view = judged.view
        after = view.after.expected if view.after is not None else None
        picture = spectra(view.channels, view.frame, view.record, view.before.expected, after)
        return (Section('Which frequencies are in it?', (), (), (picture,)),)
    try:
        frame = make_frame(len(samples.values), samples.rate_hz, DiagnosisSettings())
    except ValueError as error:
        return (Section('Which frequencies are in it?', (f'No spectrum: {error}.',)),)
    record = record_periodograms(samples, frame)[0].mean(axis=0)
    return (Section('Which frequencies are in it?', (), (), (
        spectra(samples.channels, frame, record),)),)


def _modes(samples, last, pairs):
    lines = (f'{last.reason[:1].upper()}{last.reason[1:]}.',) if last.reason else ()
    if not last.modes and not last.rejected:
        return Section('Which modes does it have?', lines)
    f = level = None
    try:
        frame = make_frame(len(samples.values), samples.rate_hz, DiagnosisSettings())
        level = density(record_periodograms(samples, frame)[0].mean(axis=0),
                        frame.rate_hz).mean(axis=1)
        f = frame.frequencies_hz
    except ValueError:          # too short for a spectrum: the poles are drawn alone
        pass
    return Section('Which modes does it have?', lines + notes(last),
                   (mode_table(last, pairs, samples.channels),),
                   (stabilisation(last, f, level), *close_modes(last)))


def _shapes(last, samples):
    return (shape_table(last, samples.channels),) if last.modes else ()


def _length(windows):
    return (modes_sentence(windows),
            f'{len(windows)} windows of {(windows[0].end_ns - windows[0].start_ns) * 1e-9:g} s. '
            'Windows that overlap share their samples: neighbouring points are not independent.',)
