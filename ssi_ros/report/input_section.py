"""What recorded inputs make of a record: the part that is predicted, and what is left of it."""
import numpy as np

from ssi_ros.report.curves import record_periodograms
from ssi_ros.report.parts import number, percent, Section, Table
from ssi_ros.report.record_pictures import spectra


def input_section(nominal, samples, settings):
    """
    Return the section of a page on a diagnosis beside recorded inputs.

    Parameters
    ----------
    nominal : ModelNominal
        With its inputs.
    samples : Samples
        The record.
    settings : DiagnosisSettings
        Segments and band.

    Returns
    -------
    Section

    """
    settings = getattr(nominal.spacecraft, 'cut', lambda usual: usual)(settings)
    _, side, record, _ = nominal.ready(samples, settings)
    values, taken = record.samples.values[:, side.known:], side.recorded.taken
    channels = record.samples.channels[side.known:]
    there = np.isfinite(values).all(axis=1)
    rms = [np.std(v[there], axis=0) for v in (values + taken, taken, values)]
    rows = tuple(
        (name, number(whole), number(predicted), number(rest),
         percent(1 - (rest / whole) ** 2) if rest < whole else 'none')
        for name, whole, predicted, rest in zip(channels, *rms))
    names = ', '.join(side.recorded.names)
    table = Table(('channel', 'recorded rms', 'predicted rms', 'rms of the rest',
                   'power explained by the input'), rows,
                  'By the model without any effect; in the unit of each channel.')
    frame = side.frame
    each = [type(samples)(v, samples.rate_hz, channels)
            for v in (values + taken, taken, values)]
    parts = [record_periodograms(s, frame)[0].mean(axis=0) for s in each]
    return Section(
        'What do the recorded inputs make of the record?',
        (f'The recorded input {names} was used: what the model makes of it is predicted, and only '
         'the rest and how it follows the input are evidence. The spectra of the other sections '
         'are of the whole motion, with the input as random excitation.',),
        (table,), (spectra(channels, frame, *parts, 'input_spectra', 'motion by the input',
                           'rest'),))
