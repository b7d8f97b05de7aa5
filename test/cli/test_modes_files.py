"""The verb `identify` writes modes to CSV and universal files, of a band, of bags in g."""
import csv
from pathlib import Path

import numpy as np
import pytest
from ssi_ros.bag import read_channels, write_samples
from ssi_ros.cli._many import _same_run, Job, job_of
from ssi_ros.cli._modes import parse_band
from ssi_ros.cli._samples import read_samples
from ssi_ros.cli.main import main, parser
from ssi_ros.records import Samples

AMBIENT = Path(__file__).resolve().parents[2] / 'bags' / 'ambient'
WINDOW = ('--window-s', '60', '--hop-s', '60')


def test_modes_of_a_band_as_csv(tmp_path, capsys):
    """A row a mode with its shape, and only those in the band."""
    path = tmp_path / 'm.csv'
    assert main(['identify', str(AMBIENT), *WINDOW, '--band', '5:20', '--modes', str(path)]) == 0
    rows = list(csv.DictReader(path.open()))
    f = [float(r['frequency_hz']) for r in rows]
    assert len(f) > 5 and 5.0 <= min(f) and max(f) <= 20.0 and f == sorted(f)
    assert max(abs(complex(float(r[f're_{c}']), float(r[f'im_{c}']))) for r in rows[:1]
               for c in ('e1_a', 'e1_b', 'e2_a', 'e2_b')) == pytest.approx(1.0)
    assert main(['identify', str(AMBIENT), *WINDOW, '--band', '200:300']) == 1
    assert 'no mode between 200 and 300 Hz' in capsys.readouterr().out


@pytest.mark.parametrize('text', ['5', '20:5', 'a:b', '5:6:7', '-1:5'])
def test_a_band_has_two_frequencies(text):
    """What is no band is refused with the form."""
    with pytest.raises(ValueError, match='--band'):
        parse_band(text)


def test_modes_as_universal_file(tmp_path):
    """Another package reads frequency, damping and shape of every mode back."""
    pyuff = pytest.importorskip('pyuff')
    path, table = tmp_path / 'm.uff', tmp_path / 'm.csv'
    for file in (path, table):
        assert main(['identify', str(AMBIENT), *WINDOW, '--modes', str(file)]) == 0
    rows = list(csv.DictReader(table.open()))
    sets = pyuff.UFF(str(path)).read_sets()
    assert len(sets) == len(rows) and {s['type'] for s in sets} == {55}
    for s, r in zip(sets, rows):
        assert abs(s['eig']) / (2 * np.pi) == pytest.approx(float(r['frequency_hz']), rel=1e-4)
        assert -s['eig'].real / abs(s['eig']) == pytest.approx(
            float(r['damping_ratio']), rel=1e-3, abs=1e-6)
        assert s['r3'][1] == pytest.approx(complex(float(r['re_e1_b']), float(r['im_e1_b'])),
                                           abs=1e-4)


def test_an_unknown_file_is_refused_before_the_work(tmp_path, capsys):
    """The ends that are known are named."""
    assert main(['identify', '/no/bag', '--modes', str(tmp_path / 'm.txt')]) == 2
    assert '.csv or .uff or .unv' in capsys.readouterr().err


def test_a_bag_in_g(tmp_path):
    """With --scale a bag in g is exported in m/s^2; a scale of 0 is refused."""
    values = np.random.default_rng(1).standard_normal((200, 1))
    write_samples(tmp_path / 'g', Samples(values, 100.0, ('a',), 10 ** 18))
    out = tmp_path / 'x.npz'
    assert main(['export', str(tmp_path / 'g'), '--output', str(out), '--scale', '9.80665']) == 0
    kept = [v for v in np.load(out).values() if v.shape == (200,) and v.dtype == float]
    assert any(np.allclose(v, 9.80665 * values[:, 0]) for v in kept)
    assert read_channels(tmp_path / 'g').values[0][0] == values[0, 0]
    assert main(['export', str(tmp_path / 'g'), '--output', str(out), '--scale', '0']) == 2


def test_a_diagnosis_of_a_bag_in_g(tmp_path):
    """Verbs that read a record beside a model or another bag take the factor, also for many."""
    values = np.random.default_rng(1).standard_normal((200, 1))
    write_samples(tmp_path / 'g', Samples(values, 100.0, ('a',), 10 ** 18))
    assert np.allclose(read_samples(tmp_path / 'g', 0.0, None, 9.80665).values, 9.80665 * values)
    for words in (['diagnose', 'g'], ['diagnose', '--many', 'g'],
                  ['calibrate', 'g', '--output', 'c.yaml']):
        args = parser(words[0]).parse_args([*words, '--scale', '9.80665'])
        assert args.scale == 9.80665
    args = parser('diagnose').parse_args(['diagnose', '--many', 'g', '--scale', '9.80665'])
    assert job_of(args).scale == 9.80665
    _same_run(tmp_path / 'run.json', Job())
    with pytest.raises(ValueError, match='scale'):
        _same_run(tmp_path / 'run.json', job_of(args))


def test_samples_as_universal_file(tmp_path, capsys):
    """Another package reads the samples of every channel back; missing ones are refused."""
    pyuff = pytest.importorskip('pyuff')
    path = tmp_path / 's.uff'
    assert main(['export', str(AMBIENT), '--output', str(path)]) == 0
    recording = read_channels(AMBIENT)
    sets = pyuff.UFF(str(path)).read_sets()
    assert [s['id1'].strip() for s in sets] == list(recording.names)
    for s, values in zip(sets, recording.values):
        assert s['type'] == 58 and s['func_type'] == 1
        assert s['abscissa_inc'] == pytest.approx(0.01)
        assert s['data'] == pytest.approx(values, rel=1e-10)
    values = np.random.default_rng(1).standard_normal((500, 1))
    values[100:110] = np.nan
    write_samples(tmp_path / 'gap', Samples(values, 100.0, ('a',)))
    assert main(['export', str(tmp_path / 'gap'), '--output', str(tmp_path / 'g.uff')]) == 2
    assert 'off even sampling at 100 Hz by up to 0.1 s' in capsys.readouterr().err
    assert not (tmp_path / 'g.uff').exists()
