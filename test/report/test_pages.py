"""Pages of a bag and of a diagnosis: complete, small, true, and opened by a real browser."""
import base64
from dataclasses import replace
import gzip
import json
import os
import re

import browser
import numpy as np
import pytest

from ssi_ros.cli.main import main
from ssi_ros.effects import inject, load_configuration, parse_effect, simulate_setup
from ssi_ros.gap.comparison import Location
from ssi_ros.gap.diagnosis import Diagnosis, Explanation, Value
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.records import Samples
from ssi_ros.report.bag_page import bag_page, Judged, windows_of
from ssi_ros.report.diagnosis_page import diagnosis_markdown, diagnosis_page, view_of
from ssi_ros.report.diagnosis_sections import _how_sure, _leading, summary
from ssi_ros.report.page import page as made_page
from ssi_ros.report.parts import Section, Table

QUESTIONS = ('Is there a gap?', 'Where is it?', 'Which effect is it?', 'How sure is that?',
             'What else could it be?', 'How far does it shrink?', 'What to do next?')
LIMIT = 5_000_000       # bytes of a page
NAN = float('nan')


def a_diagnosis(built=()):
    """Return a diagnosis as a fit of an asymmetric pair of arrays gives it."""
    best = Explanation(('array_asymmetry',), 0.98, ('array_asymmetry',), {
        'array_asymmetry.scale': Value(1.02, 2e-4, 1.0197, 1.0203, '1')}, 0.12, 0.97, 0.93, 1.01,
        True, tuple(built))
    rival = Explanation(('stiffness_scale',), 0.0196, ('stiffness_scale',), {
        'stiffness_scale.scale': Value(1.01, 2e-4, 1.0097, 1.0103, '1')}, 0.2, 0.5, 0.45, 0.54,
        False)
    unknown = Explanation(('unknown',), 4e-4, ('unknown',), {}, 0.25, 0.0, 0.0, 0.0, False)
    where = Location(
        ({'name': 'e1_a', 'share': 0.9}, {'name': 'e2_a', 'share': 0.1}),
        ({'low_hz': 0.1, 'high_hz': 25.0, 'share': 0.3},
         {'low_hz': 25.0, 'high_hz': 49.0, 'share': 0.7}),
        ({'frequency_hz': 30.98, 'name': 'E1/E2 bending <3>', 'share': 0.6},),
        ({'start_s': 0.0, 'end_s': 60.0, 'share': 1.0},),
        site={'excitation': 0.0, 'structure': 1.0, 'sensor': 0.0, 'timing': 0.0})
    return Diagnosis('EXPLAINED', 'array_asymmetry leaves a residual of 0.9 standard deviations',
                     {'before': 0.25, 'floor': 0.11, 'floor_std': 0.002, 'p_value': 0.0}, where,
                     (best, rival, unknown), {'effects': ('array_asymmetry',), 'class': (
                         'array_asymmetry',), 'probability': 0.98}, (), ('a <line>',),
                     ({'effects': ('none',), 'closed': 0.0},
                      {'effects': ('fuel_slosh',), 'closed': -0.01}))


def pictures(page):
    """Return the figures of a page by name."""
    packed = re.search(r'id="pictures">([^<]*)<', page)[1]
    return json.loads(gzip.decompress(base64.b64decode(packed)))


def array(value):
    """Return the numbers of a trace, which Plotly may have packed."""
    if isinstance(value, dict):
        flat = np.frombuffer(base64.b64decode(value['bdata']), np.dtype(value['dtype']))
        return flat.reshape([int(n) for n in str(value.get('shape', len(flat))).split(',')])
    return np.array(value)


@pytest.fixture(scope='module')
def record():
    """Return a spacecraft, an effect, 300 s simulated with it, and its view."""
    spacecraft, _ = load_configuration(None)
    effect = parse_effect('array_asymmetry:array=E1,scale=1.02')
    samples = simulate_setup(inject(spacecraft, (effect,), 300.0), 5)
    diagnosis = a_diagnosis((effect,))
    view = view_of(diagnosis, spacecraft, samples, DiagnosisSettings())
    return spacecraft, samples, diagnosis, view


@pytest.fixture(scope='module')
def whole(record):
    """Return the page of the bag, with everything that a page can hold."""
    spacecraft, samples, diagnosis, view = record
    windows = windows_of(samples, 150.0, 50.0)
    assert len(windows) == 4
    return bag_page('night', samples, windows, facts=(('seed', '5'),),
                    judged=Judged(spacecraft, diagnosis, view, 'config/spacecraft.yaml'))


def test_questions_in_order(record):
    """Page and Markdown answer the engineer's questions in the engineer's order."""
    _, _, diagnosis, view = record
    page = diagnosis_page(diagnosis, view)
    assert re.findall(r'<h2>(.*?)</h2>', page) == list(QUESTIONS)
    text = diagnosis_markdown(diagnosis, view)
    assert re.findall(r'^## (.*)$', text, re.M) == list(QUESTIONS)
    assert 'removes 97 % of the gap, 90 % interval 93 to 100 %' in text
    assert ('no effect at all removes none of the gap; an effect drawn at random (fuel_slosh) '
            'removes none of the gap') in text
    assert 'array E1, scale 1.02' in text and '--apply corrected.yaml' in text
    assert text.splitlines()[2] == (
        '**EXPLAINED: array_asymmetry: scale of array E1 is '
        '1.0200 +- 0.0002 (probability 0.98); correcting it removes 97 % of the gap.**')


def test_forms_of_one_effect_have_their_bars():
    """Two candidates of one name are two bars."""
    diagnosis = a_diagnosis()
    diagnosis = replace(diagnosis, candidates=(diagnosis.candidates[0],) * 2)
    bars = pictures(diagnosis_page(diagnosis))['probability']['data'][0]
    assert bars['y'] == ['array_asymmetry', 'array_asymmetry (2)']


def test_words_of_a_record_cannot_be_markup(record):
    """A name with angle brackets stays a name."""
    page = diagnosis_page(record[2])
    assert 'a &lt;line&gt;' in page and '<line>' not in page


def test_page_is_small_and_alone(whole):
    """A page is below 5 MB, has all pictures, and names no address to fetch anything from."""
    assert len(whole.encode()) < LIMIT
    names = {'histories', 'spectra', 'stabilisation', 'shapes3d', 'shapes', 'tracks_frequency',
             'tracks_damping', 'sensors', 'bands', 'modes', 'times', 'map_sensor_before',
             'map_time_before', 'map_sensor_after', 'probability', 'closed', 'gap_spectra'}
    assert names <= set(pictures(whole))
    assert not re.findall(r'(?:src|href)="(?!#)', whole)


def test_thinning_keeps_the_peaks(record, whole):
    """The drawn history has the record's least and greatest value of every second."""
    samples = record[1]
    trace = pictures(whole)['histories']['data'][0]
    t, v = array(trace['x']), array(trace['y'])
    assert len(t) < len(samples.values) / 10
    for second in range(300):
        inside = (t >= second) & (t < second + 1)
        part = samples.values[100 * second:100 * second + 100, 0]
        # single precision in the page
        assert np.isclose(v[inside].max(), part.max(), rtol=1e-6)
        assert np.isclose(v[inside].min(), part.min(), rtol=1e-6)


def test_thinning_keeps_gaps(record):
    """Missing samples interrupt the line, which does not bridge them."""
    from ssi_ros.report.record_pictures import thin
    values = record[1].values[:, 0].copy()
    values[10_000:10_500] = np.nan
    assert np.isnan(values[thin(values)]).any()


def test_the_effect_shrinks_the_maps(record):
    """With the true effect every field of the map is chance, without it some are not."""
    _, _, _, view = record
    # the mean square of standardised fields is 1 where a model is right; 60 bands x 4 channels
    from ssi_ros.report.gap_pictures import maps
    found = {p.name: array(p.figure.data[0].z) for p in maps(view)}
    assert np.mean(found['map_sensor_before'] ** 2) > 5.0
    assert np.mean(found['map_sensor_after'] ** 2) < 2.0


def test_before_and_after_in_user_units(record):
    """The true effect takes frequencies from over 0.3 % off to under 0.1 %, and mends shapes."""
    _, _, _, view = record
    before = [p.frequency_hz / p.mode.frequency_hz - 1 for p in view.pairs_before if p]
    after = [p.frequency_hz / p.mode.frequency_hz - 1 for p in view.pairs_after if p]
    # 2 % of D is 1 % of f on one array, about half of it on each mode of a pair
    assert np.median(np.abs(before)) > 3e-3 and np.median(np.abs(after)) < 1e-3
    macs = np.array([[a.mac, b.mac] for a, b in zip(view.pairs_before, view.pairs_after)
                     if a and b])
    assert np.median(macs[:, 1]) > 0.99 > np.median(macs[:, 0])
    recorded, _, with_effect = view.rms
    # 300 s of twenty resonances: the rms of a record scatters by some percent
    assert np.allclose(with_effect, recorded, rtol=0.1)


def test_surfaces_pass_through_the_sensors(record, whole):
    """In space the drawn surface at a sensor is the identified shape there, where MAC is 1."""
    spacecraft, _, _, _ = record
    motion = pictures(whole)['shapes3d']['motion']
    mode = next(m for m in motion['modes'] if m['sensors'] and 'MAC 1.000' in m['label'])
    for k, sensor in enumerate(spacecraft.sensors):
        surface = mode['surfaces'][[a.name for a in spacecraft.arrays].index(sensor.array)]
        corner = surface['re'][-1][-1 if sensor.lateral_m > 0 else 0]
        # the sensor sits 0.1 m inside the corner: a few percent of the deflection
        assert abs(corner - mode['sensors']['re'][k]) < 0.1


@pytest.mark.parametrize('outcome', ['WITHIN_FLOOR', 'TIED', 'UNEXPLAINED', 'TOO_LITTLE_DATA'])
def test_every_outcome_has_its_page(outcome):
    """Missing numbers and empty lists, as a reference record leaves them, make a page too."""
    nothing = {'before': NAN, 'floor': NAN, 'floor_std': NAN, 'p_value': NAN}
    where = Location((), (), (), ())
    unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, NAN, NAN, NAN, NAN, False)
    best = a_diagnosis().candidates[0]
    candidates = (unknown,) if outcome == 'TOO_LITTLE_DATA' else (
        replace(best, closed=NAN, closed_low90=NAN, closed_high90=NAN), unknown)
    found = Diagnosis(outcome, 'a reason', nothing, where, candidates, {
        'effects': (), 'class': ('a', 'b'), 'probability': 0.5}, ('a longer record',))
    for text in (diagnosis_page(found), diagnosis_markdown(found)):
        words = re.sub(r'<style>.*', '', text, flags=re.S)
        assert outcome in text and 'a reason' in text and 'nan' not in words
        assert 'What to do next?' in text


def test_captions_signs_and_minus_of_tables():
    """A caption stands outside what is scrolled; +- is typeset; no line ends behind a minus."""
    text = made_page('t', 'a is 1 +- 2', [Section('q', (), (Table(
        ('mode',), (('mode of a, -b',),), 'what it is'),))])
    assert text.index('what it is') < text.index('<div class="scroll"><table>')
    assert '<caption' not in text and 'a is 1 ± 2' in text and 'a, \u2011b' in text


def test_many_numbers_of_an_effect_are_a_row_a_mode():
    """Not a row a number: thirty numbers of ten modes are ten rows, by frequency."""
    numbers = {f'stiffness_scale.{kind}_at_{hz}000_mhz': {
        'value': hz + k, 'std': 0.01, 'low90': 0.0, 'high90': 1.0, 'unit': '1'}
        for hz in range(19, 9, -1) for k, kind in enumerate(('scale', 'tie', 'force'))}
    assert len(numbers) == 30
    section = _how_sure({'verdict': {'class': (), 'probability': 0.99}}, [
        {'effects': ('stiffness_scale',), 'parameters': numbers}])
    table, = section.tables
    assert table.heads == ('mode', 'scale', 'tie', 'force') and len(table.rows) == 10
    assert table.rows[0] == ('10 Hz', '10.000 ± 0.010', '11.000 ± 0.010', '12.000 ± 0.010')


def test_an_unexplained_gap_has_its_size_and_place_at_the_top():
    """Without an effect the first sentence says how large the gap is and where most of it is."""
    found = {'outcome': 'UNEXPLAINED', 'reason': 'r', 'candidates': (), 'gap': {
        'before': 0.5, 'floor': 0.3, 'floor_std': 0.01, 'p_value': 0.0}, 'where': {
            'site': {}, 'sensors': ({'name': 'e1_a', 'share': 0.6}, {'name': 'b', 'share': 0.4}),
            'bands': ({'low_hz': 5.0, 'high_hz': 9.0, 'share': 1.0},), 'modes': (), 'times': [
                {'start_s': 60.0 * k, 'end_s': 60.0 * k + 60.0, 'share': 0.1} for k in range(10)]}}
    assert summary(found) == ('UNEXPLAINED. There is a gap that no effect of the library '
                              'explains: r. The gap is 20 standard deviations above its floor, '
                              'the largest shares at e1_a: 60 % and at 5 to 9 Hz: 100 %.')
    # ten times a tenth say nothing
    assert _leading(found['where']).rows[-1] == ('times', 'evenly over the record', '', '')


def test_page_of_a_reference(record):
    """Two records make the same page without a spacecraft; twins differ by chance alone."""
    from ssi_ros.report.gap_pictures import before_after_tables, maps
    from ssi_ros.report.gap_view import reference_view
    spacecraft, changed, _, _ = record
    twins = [simulate_setup(inject(spacecraft, (), 300.0), seed) for seed in (1, 2)]

    def largest(view):
        field = next(p.figure.data[0].z for p in maps(view) if p.name == 'map_sensor_before')
        return float(np.mean(array(field) ** 2))
    same = reference_view(twins[0], replace(twins[1], values=3.0 * twins[1].values))
    other = reference_view(twins[0], changed)
    # mean squares of standardised fields: resonances fill few bins, so that bands of strongly
    # unequal power scatter more than even ones; 3 is what chance then reaches
    assert largest(same) < 3.0 and largest(other) > 2 * largest(same)
    assert np.isclose(same.before.levels['level'], 9.0, rtol=0.1)
    page = diagnosis_page(a_diagnosis(), other, bag='b', nominal='--reference a')
    assert '--apply' not in page
    # a change is counted from the reference: array E1 was made stiffer, so frequencies rose
    table, _ = before_after_tables(other)
    assert table.heads[:3] == ('now [Hz]', 'reference [Hz]', 'change [%]')
    assert sum(float(row[2]) > 0.0 for row in table.rows) > len(table.rows) / 2
    for row in table.rows:
        now, before = float(row[0].split()[0]), float(row[1])
        # the table rounds to two digits of the spread, 1e-4 of the lowest mode
        assert float(row[2]) == pytest.approx(100 * (now / before - 1), abs=0.03)
    with pytest.raises(ValueError, match='same channels and rate'):
        reference_view(twins[0], Samples(twins[1].values[:, :2], 100.0, ('a', 'b')))


def test_two_bags_make_a_page_with_spectra(tmp_path):
    """`diagnose --reference --html` draws both recordings, their modes and their rms."""
    bags = [str(tmp_path / n) for n in ('reference', 'record')]
    for k, bag in enumerate(bags):
        words = ['--effect', 'sensor_gain:channel=e1_b,scale=1.2'] if k else []
        assert main(['simulate', bag, '--duration-s', '120', '--seed', str(k), *words]) == 0
    path = tmp_path / 'page.html'
    assert main(['diagnose', bags[1], '--reference', bags[0], '--effects',
                 'sensor_gain,sensor_noise', '--no-pairs', '--html', str(path)]) == 0
    page = path.read_text()
    drawn = pictures(page)
    assert {'gap_spectra', 'map_sensor_before', 'map_time_before', 'sensors',
            'modes'} <= set(drawn)
    assert 'times' not in drawn         # a gain is off all the time: even bars say nothing
    names = [t['name'] for t in drawn['gap_spectra']['data']]
    assert names.count('recorded') == names.count('reference') == 4
    assert 'sensor_gain: scale of channel e1_b is 1.' in page and 'change [%]' in page


def test_windows_by_default(record):
    """Half of the record in twenty steps; a window alone gets a hop that divides it."""
    samples = record[1].between(0.0, 60.0)
    windows = windows_of(samples)
    assert len(windows) == 21 and windows[0].end_ns - windows[0].start_ns == 30_000_000_000
    windows = windows_of(samples, 7.77)
    assert 15 <= len(windows) <= 25


@pytest.mark.slow
def test_verbs_write_pages(tmp_path, capsys):
    """`report` and `diagnose --html --markdown` write what they say."""
    bag = tmp_path / 'short'
    assert main(['simulate', str(bag), '--duration-s', '60', '--effect',
                 'sensor_gain:channel=e1_a,scale=1.5']) == 0
    assert main(['report', str(bag)]) == 0
    assert 'modes in the last of' in capsys.readouterr().out
    assert 'Which shapes have the modes?' in (tmp_path / 'short.html').read_text()
    pages = [str(tmp_path / n) for n in ('d.html', 'd.md')]
    main(['diagnose', str(bag), '--effects', 'sensor_gain', '--html', pages[0], '--markdown',
          pages[1]])
    assert all(QUESTIONS[0] in open(p).read() for p in pages)
    assert main(['report', str(tmp_path / 'none')]) == 2
    assert 'does not exist' in capsys.readouterr().err


@pytest.mark.skipif(not browser.find(), reason='no Chromium here; name one in CHROMIUM')
def test_browser_draws_everything(whole, tmp_path):
    """Without a network every picture is drawn, and the page opens within 2 s."""
    path = tmp_path / 'page.html'
    path.write_text(whole, encoding='utf-8')
    opened_ms, opened = 'document.documentElement.dataset.openedMs', []
    with browser.browser(tmp_path / 'profile') as page:
        for _ in range(5):      # the least of several: other work on the machine slows a page
            page.open(f'file://{path}')
            opened.append(int(page.until(opened_ms)))
            if opened[-1] < 2000:
                break
        page.open(f'file://{path}#all')
        page.until(opened_ms)
        states = page.value('[...document.querySelectorAll(".picture")].map(p => '
                            'p.dataset.drawn + " " + p.querySelectorAll(".main-svg").length)')
        trouble = page.value('document.getElementById("trouble").innerText')
        labels = page.value('[...document.querySelectorAll("select option")].map(o => o.text)')
        # on a desktop every column of every table is in sight, that of the MAC too
        page.ask('Emulation.setDeviceMetricsOverride', width=1400, height=900,
                 deviceScaleFactor=1, mobile=False)
        cut = page.value('[...document.querySelectorAll(".scroll")].filter('
                         't => t.scrollWidth > t.clientWidth).map(t => t.innerText)')
        assert cut == [], cut
        # on a telephone wide pictures and tables scroll by themselves, the page does not
        page.ask('Emulation.setDeviceMetricsOverride', width=400, height=800,
                 deviceScaleFactor=1, mobile=True)
        assert page.value('document.documentElement.scrollWidth') == 400
    assert len(states) == len(pictures(whole)), states
    assert all(s.startswith('done') and not s.endswith(' 0') for s in states), states
    assert trouble == '' and any('MAC' in s for s in labels)
    load = os.getloadavg()[0] / os.cpu_count()
    if min(opened) >= 2000 and load > 2.0:
        pytest.skip(f'{load:.0f} processes wait for each core: no time to open can be measured')
    assert min(opened) < 2000, opened
