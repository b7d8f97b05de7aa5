"""Of the same effect at two places, or of two signs, what is hardly less likely is kept."""
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.model_answer import beyond_spectrum, parameters
from ssi_ros.gap.selection.evidence import Ranked
from ssi_ros.gap.selection.search import Search
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.report.wording import headline


def ranked(text, log_likelihood):
    """Return a fitted effect with a deviation of 0.001."""
    return Ranked(SimpleNamespace(candidate=Candidate((parse_effect(text),)),
                                  log_likelihood=log_likelihood, covariance=np.diag([1e-6])))


def in_order(*found):
    """Return fits as a search keeps them."""
    return Search(SimpleNamespace(effects=('sensor_gain', 'clock_rate')), None,
                  DiagnosisSettings(), None).sorted(list(found))


def test_another_place_is_kept_if_it_is_hardly_less_likely():
    """One place more at most, and none that is far behind."""
    best, near = ranked('sensor_gain:channel=e1_a,scale=0.99', 10.0), ranked(
        'sensor_gain:channel=e1_b,scale=1.01', 9.0)
    third, far = ranked('sensor_gain:channel=e2_a,scale=1.01', 8.5), ranked(
        'sensor_gain:channel=e2_b,scale=1.01', 5.0)
    clock = ranked('clock_rate:ppm=300', 9.5)
    assert in_order(third, near, clock, best) == [best, clock, near]
    assert in_order(far, best) == [best]


@pytest.mark.parametrize('explained, kept', [(10.0, 0.99), (130.0, 0.91), (3000.0, 0.3)])
def test_a_second_effect_counts_beside_the_law_of_the_first(explained, kept):
    """One part in 26 of a tenth of the first one lies in its direction, eq. (113g)."""
    search = Search(SimpleNamespace(
        effects=26 * ('sensor_gain',), null=SimpleNamespace(log_likelihood=5.0)), None,
        DiagnosisSettings(), None)
    single = ranked('sensor_gain:channel=e1_a,scale=0.99', 5.0 + explained)
    pair = ranked('clock_rate:ppm=300', 25.0 + explained)
    more = search.weighed(pair, single).log_evidence - single.log_evidence
    assert more == pytest.approx(20.0 * kept, rel=0.01)
    worse = ranked('clock_rate:ppm=300', explained)
    assert search.weighed(worse, single).log_evidence == worse.log_evidence


def test_a_line_counts_as_its_search_says():
    """The search has paid for its frequency; what a fit moves pays by its prior."""
    line = parse_effect('harmonic_disturbance:frequency_hz=3,torque_n_m=0.1')
    drift = parse_effect('sensor_drift:channel=e1_a,rms_m_s2=1e-4,time_constant_s=10')
    weak, strong = (SimpleNamespace(p_value=0.01, log_odds=odds) for odds in (2.0, 6.0))
    assert [beyond_spectrum(e, weak, 6.0) for e in (line, drift)] == [-4.0, 0.0]
    assert [beyond_spectrum(e, strong, 2.0) for e in (line, drift)] == [4.0, 4.0]


def test_a_line_of_which_no_number_says_how_rare_it_is_counts_by_its_spectrum():
    """Its odds end at exp(682); beside slosh that explained 1043 they were all that it had."""
    line = parse_effect('harmonic_disturbance:frequency_hz=3,torque_n_m=0.1')
    found = Detection.of_effect(line, 0.0, '', trials=1000)
    assert found.log_odds == pytest.approx(682, abs=2)
    assert beyond_spectrum(line, found, 1092.0) == pytest.approx(-np.log(1000))
    assert beyond_spectrum(line, found, 100.0) == pytest.approx(found.log_odds - 100.0)


def test_the_interval_holds_the_other_sign():
    """Unless it is far behind; each goes on with its own place."""
    first, second = ('sensor_gain:channel=e1_a,scale=1.005',
                     'sensor_gain:channel=e1_a,scale=0.994')
    for behind, low in ((1.0, 0.994), (5.0, 1.005)):
        kept, = in_order(ranked(first, 10.0), ranked(second, 10.0 - behind))
        value = parameters(kept, ())['sensor_gain.scale']
        assert value.value == 1.005
        assert value.low90 == pytest.approx(low - 1.645e-3)
        assert value.high90 == pytest.approx(1.005 + 1.645e-3)


@pytest.mark.parametrize('text, opposite', [
    ('sensor_gain:channel=e1_b,scale=1.01', ['sensor_gain:channel=e1_b,scale=0.99']),
    ('sensor_crosstalk:source=e1_b,channel=e1_a,gain=0.02',
     ['sensor_crosstalk:source=e1_b,channel=e1_a,gain=-0.02']),
    ('sensor_misplacement:channel=e1_a,along_m=0.02,lateral_m=-0.01',
     ['sensor_misplacement:channel=e1_a,along_m=-0.02,lateral_m=0.01']),
    ('stiffness_scale:scale=1.01', []), ('channel_delay:channel=e1_a,delay_s=0.001', []),
    ('sensor_bandwidth:channel=e1_a,corner_hz=40', [])])
def test_the_opposite_of_an_effect(text, opposite):
    """Only of what mixes or shifts channels, by an amount of either sign."""
    assert [e.text() for e in parse_effect(text).opposite()] == [
        parse_effect(o).text() for o in opposite]


def test_the_first_sentence_names_the_other_place():
    """With the size that it has there and its probability, and none that is improbable."""
    def at(channel, probability, scale=1.01):
        return {'effects': ['sensor_gain'], 'probability': probability, 'closed': None,
                'parameters': {
                    'sensor_gain.channel': {'value': channel, 'std': None, 'unit': ''},
                    'sensor_gain.scale': {'value': scale, 'std': 1e-3, 'unit': '1'}}}
    found = {'outcome': 'EXPLAINED', 'reason': 'r', 'verdict': {'class': ['sensor_gain']},
             'candidates': [at('e1_a', 0.5), at('e1_b', 0.3, 0.99), at('e2_a', 0.01)]}
    said = headline(found)
    assert ('It could also be sensor_gain: scale of channel e1_b is 0.990 +- 0.001 '
            '(probability 0.30)') in said
    assert 'e2_a' not in said
