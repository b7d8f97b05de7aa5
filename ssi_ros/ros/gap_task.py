"""What the gap node compares samples with, and how much of them may be missing for a diagnosis."""
from dataclasses import dataclass

import numpy as np
from ssi_ros.quantity import quantity


@dataclass(frozen=True)
class GapTask:
    """What the samples are compared with."""

    model: str = quantity('', live=False, doc='spacecraft YAML of the nominal simulator; empty = '
                          'the one that comes with the package')
    inputs: tuple = quantity(
        ('',), live=False, doc='recorded inputs of the model for ~/diagnose, entries '
        '/topic[:field][=NAME] as of `ssi_ros diagnose --input`, or {topic: T, type: '
        'pkg/msg/Type, field: F, name: NAME}; an empty entry is none')
    record_s: float = quantity(600.0, unit='s', low=10.0, high=86400.0, live=False,
                               doc='length of the record kept for ~/diagnose')
    diagnosis: str = quantity('', live=False, doc='settings of ~/diagnose, YAML as '
                              'config/diagnosis.yaml; empty = the defaults')
    effects: tuple = quantity(('',), live=False, doc='effects to consider, by name; an empty '
                              'entry stands for the whole library')
    diagnosis_missing_share: float = quantity(
        0.1, low=0.0, high=0.5,
        doc='~/diagnose is refused where a channel lacks more of its samples')
    pairs: bool = quantity(True, live=False, doc='let ~/diagnose look for two effects at once')


def missing_words(record):
    """Return which share of the samples of a record are missing, in words."""
    shares = np.isnan(record.values).mean(axis=0)
    gone = [f'{name} {100 * share:.2g} %' for name, share in zip(record.channels, shares) if share]
    return 'samples missing, masked and filled: ' + ', '.join(gone) if gone else 'none is missing'


def refusal(record, most):
    """
    Return why a record is not diagnosed, an empty text if it is.

    Parameters
    ----------
    record : Samples
        Values are NaN where a sample is missing.
    most : float
        Largest share of missing samples of a channel [1].

    """
    shares = np.isnan(record.values).mean(axis=0)
    if shares.max() <= most:
        return ''
    return (f'no diagnosis: channel {record.channels[int(shares.argmax())]} lacks '
            f'{100 * shares.max():.0f} % of its samples of the last {record.duration_s:.0f} s, '
            f'more than diagnosis_missing_share={most:g}; mend the link or wait until the gap has '
            'passed')
