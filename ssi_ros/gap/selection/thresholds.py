"""Limits of the selection among candidates, each with its origin."""
from ssi_ros.gap.settings import Threshold

SELECTION = {
    'size_range': Threshold(
        6.0, 'nats', 'engineering choice: an unknown size lies within a factor of 400, the span '
        'between the detection limit and the declared ranges of the library'),
    'undetectable_sizes': Threshold(
        0.2, '1', 'share of that range below one standard deviation: a size too small to be '
        'detected keeps a fifth of the odds, eq. (112a)'),
    'narrow_posterior': Threshold(
        10.0, 'sd', 'eq. (112a): beyond it the asymptotic form differs by less than 1 %'),
    'undetected_share': Threshold(
        0.5, '1', 'engineering choice: half of the effects without a template stay below the '
        'detection limit'),
    'alternative_exponent': Threshold(
        0.15, '1', 'a of the density a p^(a - 1) of p-values under an alternative: Sellke, '
        'Bayarri and Berger, Am. Stat. 55(1), 2001; engineering choice within that family'),
    'doubt': Threshold(
        0.01, '1', 'engineering choice: share of records that a likelihood is not right about, in '
        'a way that no test sees; nothing is more probable than 1 less this'),
    'missed_share': Threshold(
        0.03, '1', 'simulation: 2 of 150 single effects beside calibrated models leave a residual '
        'though the library has them, eq. (113f); more where laws are those of a real spacecraft'),
    'law_error': Threshold(
        0.1, '1', 'engineering choice: share of its own size that the law of an effect is off by, '
        'eq. (113e): none is exact for a real spacecraft'),
    'residual_p': Threshold(
        3e-3, '1', 'p-value of the residual below which a candidate does not explain the record: '
        'three standard deviations, two-sided'),
    'residual_deviations': Threshold(
        3.0, 'sd', 'residual gap that counts as inside the floor: three standard deviations'),
    'second_effect_p': Threshold(
        0.05, '1', 'p-value of the residual below which a second effect is searched: the usual '
        'level of a test, cheap to be wrong about'),
    'far': Threshold(
        30.0, 'sd', 'residual above which the size may be far from every start: a quadratic '
        'of the likelihood holds no longer'),
    'no_tie': Threshold(
        0.8, '1', 'probability of one effect above which no tie is reported: four to one'),
    'decides': Threshold(
        0.5, '1', 'probability of none that decides: the larger half'),
    'shown': Threshold(
        0.01, '1', 'engineering choice: p-value up to which a finding is shown to a user'),
    'own_error': Threshold(
        2.0, 'sd', 'declared deviations up to which an effect and an error of the model are tied: '
        'the usual 95 % of a normal error'),
    'tied_share': Threshold(
        0.05, '1', 'probability, over that of all known effects, from which an effect belongs '
        'to a tie: a law whose size is not detected keeps a fifth of the odds of the best'),
    'near_form': Threshold(
        0.0067, '1', 'probability, over that of all known effects, from which an approximate form '
        'adds the effects that share it to the class: five nats behind the best'),
    'other_mode': Threshold(
        2.9, 'nats', 'log evidence behind the best of what is in its 90 % interval: 19 to 1'),
    'pruning_margin': Threshold(
        12.0, 'nats', 'log evidence behind the best at which a candidate is dropped: odds of '
        '1 to 160,000'),
    'hopeless': Threshold(
        40.0, 'nats', 'engineering choice: likelihood behind the best at which the first fit '
        'of a candidate ends early'),
    'promising': Threshold(
        2.0, 'nats', 'gain of the log likelihood that a template must promise: two standard '
        'deviations'),
    'indistinguishable': Threshold(
        0.97, '1', 'cosine of templates above which one effect replaces another in a pair'),
    'approximate_pair': Threshold(
        15.0, 'nats', 'log posterior over the best single effect that a pair of approximate forms '
        'must have: what ten per cent of a gap of 30 standard deviations gives by chance'),
    'largest_correction': Threshold(
        1.5, '1', 'share of what two simulated records lose that a candidate may be corrected by: '
        'scatter of two draws'),
    'closed_defined': Threshold(
        3.0, 'sd', 'gap above its floor from which the reduction of the gap is defined, '
        'eq. (113)'),
}
