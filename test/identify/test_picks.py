"""Poles that somebody picked are the modes, in every window."""
import json

import numpy as np
import pytest
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.bag import write_samples
from ssi_ros.cli.main import main
from ssi_ros.identify import Identification, identify, Method
from ssi_ros.identify.picks import load_picks, Pick, SCHEMA
from ssi_ros.identify.plot_stability import accepted
from ssi_ros.records import Samples

SETTINGS = Identification(window_s=60.0, hop_s=10.0)


@pytest.fixture(scope='module')
def samples():
    """Return 80 s of two close pairs."""
    return Samples(accelerations(PAIR_HZ, PAIR_SHAPES, 80.0, np.random.default_rng(3)), 100.0,
                   tuple('abcd'))


def test_picked_poles_are_the_modes(samples):
    """One pole a mode and one that was rejected: those, and no other, with spreads and shapes."""
    last = identify(samples, SETTINGS)[-1]
    chosen = [min((p for p in accepted(last) if abs(p.frequency_hz / m.frequency_hz - 1) < 1e-3),
                  key=lambda p: abs(p.frequency_hz - m.frequency_hz)) for m in last.modes[:2]]
    left_out = next(p for p in last.rejected if p.order and p.frequency_hz > 20.0
                    and 'outside' not in p.reason)
    picks = tuple(Pick(p.frequency_hz, p.order) for p in (*chosen, left_out))
    windows = identify(samples, SETTINGS, method=Method(picks=picks))
    found = sorted(windows[-1].modes, key=lambda m: m.frequency_hz)
    assert [m.frequency_hz for m in found] == pytest.approx(
        sorted(p.frequency_hz for p in picks), rel=1e-9)
    same = min(found, key=lambda m: abs(m.frequency_hz - last.modes[0].frequency_hz))
    assert np.abs(np.vdot(same.shape, last.modes[0].shape)) > 0.95 * np.linalg.norm(
        same.shape) * np.linalg.norm(last.modes[0].shape)
    assert all(np.isfinite(m.frequency_std_hz) for m in found)
    assert 'not picked' in {p.reason for p in windows[-1].rejected}
    # in the windows before it is followed, not invented
    for w in windows[:-1]:
        assert all(min(abs(m.frequency_hz / p.frequency_hz - 1) for p in picks) <= 0.02
                   for m in w.modes)


def test_where_nothing_is_near_there_is_no_mode(samples):
    """A pick far from every pole finds none, and the window says so."""
    window = identify(samples, SETTINGS, method=Method(picks=(Pick(1e4, 10),)))[-1]
    assert window.modes == () and window.reason


def test_the_verb_takes_the_file_of_the_page(samples, tmp_path, capsys):
    """`--plot` writes a page that picks, `--picks` reads what it saves."""
    write_samples(tmp_path / 'bag', samples)
    words = ['identify', str(tmp_path / 'bag'), '--window-s', '60', '--hop-s', '10']
    more = ['--start-s', '0.5', '--band', ':1000', '--efdd']
    assert main([*words, *more, '--plot', str(tmp_path / 'plots')]) == 0
    text = (tmp_path / 'plots' / 'index.html').read_text()
    # the command that the page shows has all that was typed, but for the pictures
    assert (f"identify {tmp_path / 'bag'} --start-s 0.5 --band :1000 --efdd --window-s 60 "
            '--hop-s 10 --picks picks.json') in text and SCHEMA in text
    assert 'EFDD [Hz]' in capsys.readouterr().out
    last = identify(samples, SETTINGS)[-1]
    pole = max(accepted(last), key=lambda p: p.order)
    (tmp_path / 'picks.json').write_text(json.dumps({'schema': SCHEMA, 'picks': [
        {'frequency_hz': pole.frequency_hz, 'damping_ratio': 0.01, 'order': pole.order}]}))
    assert main([*words, '--picks', str(tmp_path / 'picks.json'), '--json', '-']) == 0
    windows = json.loads(capsys.readouterr().out)['windows']
    assert [len(w['modes']) for w in windows] == [1] * len(windows)
    assert windows[-1]['modes'][0]['frequency_hz'] == pytest.approx(pole.frequency_hz, rel=1e-9)


@pytest.mark.parametrize('text, said', [
    ('{', 'not of the form'), ('[]', 'not of the form'), ('{"schema": "ssi_ros/picks/1"}', 'form'),
    ('{"schema": "ssi_ros/picks/1", "picks": []}', 'holds no pick'),
    ('{"schema": "ssi_ros/picks/2", "picks": []}', 'not of the form'),
    ('{"schema": "ssi_ros/picks/1", "picks": [{"frequency_hz": -1, "order": 4}]}', 'positive'),
    ('{"schema": "ssi_ros/picks/1", "picks": [{"frequency_hz": NaN, "order": 4}]}', 'positive'),
    ('{"schema": "ssi_ros/picks/1", "picks": [{"frequency_hz": "5", "order": 4}]}', 'positive'),
    ('{"schema": "ssi_ros/picks/1", "picks": [{"frequency_hz": 5, "order": 4.5}]}', 'whole')])
def test_a_file_of_another_form_is_refused(text, said, tmp_path):
    """One sentence each that says what is needed."""
    (tmp_path / 'p.json').write_text(text)
    with pytest.raises(ValueError, match=said):
        load_picks(tmp_path / 'p.json')
