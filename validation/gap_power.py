"""
How often effects of a size can be seen at all by a test that looks for every effect at once.

    python -m validation.gap_power

The bound is that of an ideal test whose templates hold the effect exactly. Scores are Gaussian of
unit variance with mean d'; the largest of all must pass what chance passes in as many records as
false alarms are allowed, eq. (104) and (105). Of a sine, a sweep or a swing also the place is
searched, over so many cells of exponential power.
"""
import numpy as np
from scipy.stats import ncx2

from ssi_ros.effects import applicable, effect_class
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors import tests_of
from ssi_ros.gap.detectors.thresholds import LIMITS
from ssi_ros.gap.inference.score_test import make_templates, promise
from ssi_ros.gap.nominal.model_answer import SCORE_SHARE, STATISTICS
from ssi_ros.gap.nominal.model_comparison import ANOMALY_TESTS
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.nominal.starting_points import starting_points
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.updating.model_uncertainty import model_uncertainty
from validation.report import table, write

SECONDS = 600.0
SIZES = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
NULLS, DRAWS, PLACES = 20_000, 4000, 6
OTHER_SHARE = (1 - SCORE_SHARE) / (tests_of(applicable(None)) + ANOMALY_TESTS + STATISTICS)


def of_templates(settings):
    """Return the threshold of |z|, and the power at SIZES of every effect with templates."""
    spacecraft = load_spacecraft()
    frame = make_frame(round(SECONDS * spacecraft.rate_hz), spacecraft.rate_hz, settings)
    simulator = Simulator(spacecraft, frame, SECONDS)
    templates = make_templates(simulator, starting_points(
        [effect_class(n) for n in applicable(None)], spacecraft))
    nominal = simulator.expected(Candidate())
    uncertainty = model_uncertainty(simulator, Candidate(), np.ones(len(nominal.names)), settings)
    cosine = promise(templates, nominal, frame, uncertainty)[1]
    values, vectors = np.linalg.eigh(cosine)
    chance = np.random.default_rng(0).standard_normal((NULLS, len(values))) @ (
        vectors * np.sqrt(np.maximum(values, 0.0))).T
    threshold = float(np.quantile(np.abs(chance).max(axis=1),
                                  1 - SCORE_SHARE * settings.false_alarm))
    powers = {}
    for i, effect in enumerate(templates.effects):
        rows = powers.setdefault(effect.name, [])
        if len(rows) < PLACES:
            rows.append([np.mean(np.abs(chance[:DRAWS] + size * cosine[i]).max(axis=1) > threshold)
                         for size in SIZES])
    return threshold, {name: np.mean(rows, axis=0) for name, rows in powers.items()}


def of_search(cells, settings):
    """Return the power at SIZES of a search for power in so many cells."""
    least = -2 * np.log(OTHER_SHARE * settings.false_alarm / cells)
    return ncx2.sf(least, 2, np.square(SIZES))


def main():
    """Write docs/validation/power.md."""
    settings = DiagnosisSettings()
    threshold, powers = of_templates(settings)
    rate_hz = load_spacecraft().rate_hz
    top = settings.high_share * rate_hz / 2
    searched = {'harmonic_disturbance': 1.5 * top * SECONDS,
                'nonstationary_excitation': 4 * LIMITS.fastest_hz.value * SECONDS,
                'wheel_speed_sweep': 20 * (top * SECONDS) ** 2}
    powers.update({name: of_search(cells, settings) for name, cells in searched.items()})
    mean = np.mean(list(powers.values()), axis=0)
    rows = [(name, *(f'{p:.2f}' for p in powers[name]))
            for name in applicable(None) if name in powers]
    rows.append(('mean', *(f'{p:.2f}' for p in mean)))
    head = tuple(f'size {s:g}' for s in SIZES)
    lines = [
        f'Chosen are {100 * settings.false_alarm:g} % false alarms at most, of which scores may '
        f'make {100 * SCORE_SHARE:g} % and each search {100 * OTHER_SHARE:g} %. So the largest of '
        f'all scores must pass {threshold:.2f} standard deviations, and any test that considers '
        'the whole library sees an effect of the size 4 in about seven records of ten. What is '
        'not seen cannot be named: no diagnosis names 95 % of these. Who asks for few effects '
        '(`--effects`) sees smaller ones.', '',
        'The power of an ideal test in 600 s, sizes in standard deviations of its score with '
        'levels and model errors unknown. Steps, clipping and losses show in the samples at any '
        'size, pulses one by one.', '', *table(('effect', *head), rows)]
    write('power', 'What can be seen at all', lines, command='gap_power')


if __name__ == '__main__':
    main()
