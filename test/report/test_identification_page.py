"""The page of `identify --plot`."""
from dataclasses import replace
import json

import browser
import numpy as np
import pytest
from ssi_ros.identify import Identification, identify
from ssi_ros.identify.picks import load_picks
from ssi_ros.identify.plot_tracks import thinned
from ssi_ros.model import assemble, load_spacecraft, simulate
from ssi_ros.quantity import with_spread
from ssi_ros.records import WindowModes
from ssi_ros.report.identification_page import identification_page
from ssi_ros.report.mode_pictures import shape_table, stabilisation


@pytest.fixture(scope='module')
def windows():
    """Return three windows of a minute of the spacecraft."""
    return identify(simulate(assemble(load_spacecraft()), 80.0, 1), Identification(
        window_s=60.0, hop_s=10.0))


def test_every_mode_is_on_it_once_by_frequency(windows):
    """Modes rise in the table and in the shapes, under one name; no network is needed."""
    last = windows[-1]
    text = identification_page('bag', windows, tuple('abcd'), command='ssi_ros identify bag')
    assert '<script src=' not in text and '<link' not in text
    at = [text.index(f'>{with_spread(m.frequency_hz, m.frequency_std_hz, 4, "±")}<')
          for m in sorted(last.modes, key=lambda m: m.frequency_hz)]
    assert at == sorted(at) and len(at) > 5
    names = list(shape_table(last, tuple('abcd')).figure.data[0].y)
    assert names[0].startswith(f'mode 1: {min(m.frequency_hz for m in last.modes):.3f} Hz')
    assert 'ssi_ros identify bag --picks picks.json' in text


def test_every_pole_can_be_picked(windows):
    """A pole carries its frequency and order; the trace of picks comes after all others."""
    picture = stabilisation(windows[-1], pick=True)
    assert picture.motion == {'pick': len(picture.figure.data)}
    for trace in picture.figure.data:
        for (frequency_hz, _, order), x, y in zip(trace.customdata, trace.x, trace.y):
            assert frequency_hz == pytest.approx(x, abs=1e-5) and order == y
    assert stabilisation(windows[-1]).motion is None


def test_a_window_without_modes_says_why():
    """The reason stands where the modes would, and nothing is drawn."""
    text = identification_page('bag', [WindowModes(0, 10 ** 9, (), 'nothing moves')], ('a',))
    assert 'nothing moves' in text and 'class="picture"' not in text


def test_a_day_of_windows_stays_small(windows):
    """Ten thousand windows are thinned: a message to an operator's laptop."""
    day = [replace(windows[k % len(windows)], start_ns=k * 10 ** 9, end_ns=(k + 60) * 10 ** 9)
           for k in range(10000)]
    f = np.linspace(0.1, 50.0, 500)
    small = len(identification_page('bag', windows, tuple('abcd'), (f, -f)))
    text = identification_page('bag', thinned(day), tuple('abcd'), (f, -f), total=len(day))
    assert len(text) < small + 1_000_000 and '10000 windows of 60 s' in text


# middles of the markers of a trace by its name, on the screen
MARKERS = """(() => {
  const place = document.getElementById("stabilisation");
  place.scrollIntoView();
  const at = place.data.findIndex(d => d.name === "pole of a mode");
  const id = place._fullData[at].uid;
  return JSON.stringify([...place.querySelectorAll(".trace" + id + " .points path")].map(p => {
    const box = p.getBoundingClientRect();
    return [box.x + box.width / 2, box.y + box.height / 2]; }));
})()"""

POINTED = 'document.getElementById("stabilisation")._hoverdata?.[0]?.customdata?.[0]'


@pytest.mark.skipif(not browser.find(), reason='no Chromium here; name one in CHROMIUM')
def test_a_click_picks_and_the_file_is_read(windows, tmp_path):
    """Two poles are clicked, one of them let go; what is saved is the other one."""
    path = tmp_path / 'page.html'
    path.write_text(identification_page('bag', windows, tuple('abcd')), encoding='utf-8')
    poles = [p for b in windows[-1].bands for p in b.accepted]
    with browser.browser(tmp_path / 'profile') as page:
        page.open(f'file://{path}#all')
        page.until('document.documentElement.dataset.openedMs')
        places = json.loads(page.value(MARKERS))
        assert len(places) == len(poles)
        apart = max(range(1, len(places)), key=lambda k: abs(places[k][0] - places[0][0]))

        def click(k):
            """Point at a pole, wait until it is what a click would pick, and click."""
            at = {'x': places[k][0], 'y': places[k][1], 'button': 'left', 'clickCount': 1}
            page.ask('Input.dispatchMouseEvent', type='mouseMoved', **at)
            # Plotly looks for the point below the mouse at most every 50 ms, also when it clicks
            page.until(f'({POINTED})?.toFixed(4) === "{poles[k].frequency_hz:.4f}"')
            for kind in ('mousePressed', 'mouseReleased'):
                page.ask('Input.dispatchMouseEvent', type=kind, **at)
        words = 'document.querySelector("figure .controls span").textContent'
        click(0)
        page.until(f'{words}.includes("{poles[0].frequency_hz:.4f} Hz")')
        click(apart)
        page.until(f'{words}.includes("{poles[apart].frequency_hz:.4f} Hz")')
        click(0)
        page.until(f'!{words}.includes("{poles[0].frequency_hz:.4f} Hz")')
        page.value('void (real => { URL.createObjectURL = blob => { blob.text().then('
                   't => { window.saved = t; }); return real.call(URL, blob); }; })('
                   'URL.createObjectURL)')
        page.value('document.querySelector("figure .controls button").click()')
        saved = page.until('window.saved')
    (tmp_path / 'picks.json').write_text(saved)
    pick, = load_picks(tmp_path / 'picks.json')
    assert (pick.frequency_hz, pick.order) == (poles[apart].frequency_hz, poles[apart].order)
