"""All families of the open-set test on one record, each with a calibrated p-value and a text."""
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ssi_ros.open_set.amplitude import dependence_on_amplitude, distribution
from ssi_ros.open_set.curves import asymmetry, channel_curve
from ssi_ros.open_set.jumps import jump
from ssi_ros.open_set.outliers import spikes, switching_input
from ssi_ros.open_set.products import modulation, of_channel, of_mode, slow_variation
from ssi_ros.open_set.spectra import modes_of

FASTEST_HZ = 1.0        # modulation that is tried
NEW = ', and did not before'    # of what a reference does not show
LEAST = 1e-300          # p-value: smaller ones would have no logarithm
LARGEST = 0.95          # p-value: one would have the tangent of minus infinity
DEPENDENT = 2.5         # factor of the joined p-value, of the same records
FAR = 70.0              # -log p of motion that is far from Gaussian, p = 1e-30
OWN = 3.0               # records that theory counts as, beside simulated ones
# factor and power of the theoretical p-values: python -m validation.gap_unknown calibrate
FAMILIES = dict.fromkeys((
    'amplitude', 'distribution', 'asymmetry', 'curve', 'spikes', 'input', 'jump of a mode',
    'modulation of a mode', 'slow variation of a mode', 'jump of a gain', 'modulation of a gain',
    'slow variation of a gain'), (1.0, 1.0)) | {
        'distribution': (0.54, 0.64), 'curve': (0.90, 0.95), 'spikes': (0.8, 1.0),
        'jump of a mode': (1.0, 0.9)}
OF_MODES = ('amplitude', 'distribution', 'asymmetry', 'jump of a mode', 'modulation of a mode',
            'slow variation of a mode')
# Seconds c of a further power 1 / (1 + c / T) in a record of T seconds: the same command at 30 s,
# 60 s and 120 s. Cumulants and curves of few independent values have heavy tails.
SHORT_S = {'curve': 20.0, 'spikes': 20.0, 'input': 10.0}


@dataclass(frozen=True)
class Finding:
    """What one family of statistics found, the less probable the clearer."""

    family: str
    p_value: float
    text: str
    channel: str = ''           # that it is of, if one


def findings(record, input_values, rows, edge, asked=tuple(FAMILIES)):
    """
    Return one Finding of every family asked.

    Parameters
    ----------
    record : RecordSpectra
        A record beside a model.
    input_values : ndarray, shape (k,)
        Spectrum of its first input, whitened.
    rows : ndarray of int, shape (n,)
        Samples that the taper does not disturb, and that were recorded.
    edge : float
        Share of the record, at both ends, in which nothing is asked.
    asked : sequence of str
        Names of families; all by default.

    Returns
    -------
    tuple of Finding

    """
    of = _Products(record, edge)
    tests = {
        'curve': lambda: channel_curve(record, edge), 'spikes': lambda: spikes(record, rows),
        'input': lambda: switching_input(record, input_values, rows),
        'jump of a gain': lambda: jump(of.gains),
        'modulation of a gain': lambda: modulation(of.gains),
        'slow variation of a gain': lambda: slow_variation(of.gains),
        'amplitude': lambda: dependence_on_amplitude(of.products),
        'distribution': lambda: distribution(of.modes),
        'asymmetry': lambda: asymmetry(record, of.modes, edge),
        'jump of a mode': lambda: jump(of.numbers),
        'modulation of a mode': lambda: modulation(of.numbers),
        'slow variation of a mode': lambda: slow_variation(of.numbers)}
    found = []
    for name in (n for n in tests if n in asked):
        # a short record holds no mode that decays often enough in it
        tested = name not in OF_MODES or of.modes
        p_value, text = tests[name]() if tested else (1.0, 'no mode was tested')
        found.append(Finding(name, calibrated(name, p_value, record.duration_s),
                             f'{text[0].upper()}{text[1:]}.'))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Products:
    """The products of a record that several families share, each computed when it is asked."""

    record: object
    edge: float

    @cached_property
    def modes(self):
        return modes_of(self.record)

    @cached_property
    def products(self):
        return [of_mode(m, self.record.duration_s, FASTEST_HZ, self.edge) for m in self.modes]

    @property
    def numbers(self):
        return [p for m in self.products for p in m.pair]

    @cached_property
    def gains(self):
        return [of_channel(self.record, i, FASTEST_HZ, self.edge)
                for i in range(len(self.record.channels))]


def calibrated(family, p_value, duration_s):
    """Return the p-value that records of that length, without effect, give to such a theory's."""
    factor, power = FAMILIES[family]
    found = min(1.0, factor * max(p_value, LEAST) ** power)
    return of_short_record(found, SHORT_S.get(family, 0.0), duration_s)


def of_short_record(p_value, short_s, duration_s):
    """Return the p-value of a record whose tails are heavier the shorter it is."""
    return float(p_value ** (1 / (1 + short_s / duration_s)))


def beside(p_value, family, simulated):
    """Return a p-value held against those of records of the same model, lists (r,) by family."""
    # a model of somebody else undergoes some of the tests alone
    logs = {f: -np.log(np.maximum(simulated[f], LEAST)) for f in FAMILIES if f in simulated}
    if family not in logs:
        return p_value
    if max(values.mean() for values in logs.values()) > FAR:
        # motion of few impulses: products of it have no theory, and five records show no tail
        return 1.0
    # -log p has the mean 1 where the spectrum is right and the motion Gaussian
    mean = (OWN + logs[family].sum()) / (OWN + len(logs[family]))
    return float(p_value ** (1 / max(1.0, mean)))


def joined(p_values):
    """Return the Cauchy combination of the p-values of all families."""
    angles = np.tan((0.5 - np.clip(p_values, 1e-300, LARGEST)) * np.pi)
    # a tangent beyond 1e15 is 1 / (pi p)
    small = np.asarray(p_values) < 1e-12
    angles[small] = 1 / np.pi / np.maximum(np.asarray(p_values)[small], 1e-300)
    mean = angles.sum() / len(FAMILIES)
    # families that see one and the same thing by chance add up
    return float(min(1.0, DEPENDENT * np.arctan2(1.0, mean) / np.pi))
