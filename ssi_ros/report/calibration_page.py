"""A calibration as one HTML page: what moved, and the spectra before and after."""
from dataclasses import replace

from ssi_ros.quantity import fixed
from ssi_ros.report.gap_pictures import before_after_tables
from ssi_ros.report.gap_view import gap_view
from ssi_ros.report.page import page
from ssi_ros.report.parts import number, Section, Table
from ssi_ros.report.record_pictures import spectra
from ssi_ros.report.residual_pictures import residual_section

MOST = 40               # errors in the table, those that moved most


def calibration_page(found, model, recordings, settings, present, bags):
    """
    Return a calibration as an HTML page that needs no network.

    Parameters
    ----------
    found : Calibrated
        What `calibrate` returned.
    model : Spacecraft
        As it was before.
    recordings : sequence of Samples
        The healthy recordings.
    settings : DiagnosisSettings
        Segments and band.
    present : tuple of Effect
        Effects that the model has.
    bags : sequence of str
        Names of the recordings; the spectra and the title are of the first.

    Returns
    -------
    str

    """
    pairs = [[gap_view(craft, samples, settings=settings, present=present)
              for craft in (model, found.spacecraft)] for samples in recordings]
    before, after = pairs[0]
    view = replace(before, after=after.before, pairs_after=after.pairs_before,
                   rms=(*before.rms, after.rms[1]), better='calibrated model')
    moved = found.moved
    shown = 6 if len(recordings) > 1 else 5     # a scatter between recordings needs two
    errors = Table(
        ('number', 'moved by', 'in declared deviations', 'declared', 'remains', 'scatter')[:shown],
        tuple((m.name, number(m.value), f'{m.value / m.declared:+.1f}', number(m.declared, 2),
               number(m.remains, 2), number(m.scatter, 2))[:shown] for m in moved[:MOST]),
        f'The {min(MOST, len(moved))} of {len(moved)} numbers that moved most. Relative errors, '
        'logarithms of damping ratios, metres of places.')
    # of several recordings it is said which one is meant
    which = tuple(f'{b}: ' * (len(bags) > 1) for b in bags)
    checks = tuple(
        f'{w}Gap {fixed(c.before, 4)} nats a band before, {fixed(c.after, 4)} after, '
        f'{fixed(c.deviations, 1)} standard '
        'deviations above its floor.' for w, c in zip(which, found.checks))
    lost = tuple(f'{w}{m.text}.' if w else f'{m.text[0].upper()}{m.text[1:]}.'
                 for w, m in zip(which, found.missing)) + found.notes
    rest = tuple(f'{w}Not explained: {d}.' for w, c in zip(which, found.checks)
                 for d in c.detected)
    most = moved[0] if moved else None
    summary = ('The calibrated model explains the healthy recordings' if found.explains else
               'The calibrated model does not explain all of the healthy recordings') + (
        f'; what moved most is {most.name}, by {fixed(most.value / most.declared, 1, "+")} of the '
        'standard deviations that the model declares.' if most else '.')
    return page(f'Calibration on {bags[0]}', summary, (
        Section('Does the calibrated model explain the recordings?', lost + checks + rest,
                before_after_tables(view),
                (spectra(view.channels, view.frame, view.record, view.before.expected,
                         view.after.expected, 'calibration_spectra', 'model', view.better),)),
        residual_section(bags, pairs), Section('What moved?', (), (errors,))))
