"""One page of an identification: its modes, poles to pick, shapes at the channels, tracks."""
from ssi_ros.report.mode_pictures import (
    close_modes, mode_table, notes, shape_table, stabilisation, tracks)
from ssi_ros.report.mode_words import modes_sentence
from ssi_ros.report.page import page
from ssi_ros.report.parts import Section


def identification_page(name, windows, channels, spectrum=None, *, total=0, command=''):
    """
    Return the page as text.

    Parameters
    ----------
    name : str
        Of the bag.
    windows : sequence of WindowModes
        By rising time, thinned where there are very many; the last one is shown in detail.
    channels : sequence of str
        Names.
    spectrum : tuple of ndarray, optional
        Frequencies [Hz] and levels [dB over 1/Hz] of the last window, all channels scaled to unit
        variance.
    total : int
        Windows before the thinning; 0 if there was none.
    command : str
        What was typed, to which picks are added.

    Returns
    -------
    str

    """
    last = windows[-1]
    lines = (f'{last.reason[:1].upper()}{last.reason[1:]}.',) if last.reason else ()
    drawn = ()
    if last.modes or last.rejected:
        f, level = (spectrum[0], 10.0 ** (spectrum[1] / 20.0)) if spectrum else (None, None)
        drawn = (stabilisation(last, f, level, '1/√Hz, channels of unit variance', pick=True),
                 *close_modes(last))
    sections = [Section('Which modes does it have?', lines + notes(last),
                        (mode_table(last, channels=channels),) if last.modes else (), drawn)]
    if drawn and command:
        sections.append(Section(
            'Do you choose otherwise?', (
                'Click on poles in the diagram above, and save them: these poles are then the '
                'modes, in every window.',), commands=(f'{command} --picks picks.json',)))
    if last.modes:
        sections.append(Section('Which shapes have the modes?', (), (),
                                (shape_table(last, channels),)))
    if any(w.modes for w in windows):
        thin = f'; {len(windows)} of them are drawn' if total > len(windows) else ''
        sections.append(Section(
            'Do they stay?', (
                modes_sentence(windows),
                f'{total or len(windows)} windows of '
                f'{(last.end_ns - last.start_ns) * 1e-9:g} s{thin}. Windows that overlap share '
                'their samples: neighbouring points are not independent.'), (),
            (tracks(windows, 'frequency'), tracks(windows, 'damping'))))
    return page(f'Identification of {name}', modes_sentence(windows), sections)
