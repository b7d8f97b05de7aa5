"""The verbs info, recover, export and import, as a user types them."""
import json

import sys

import numpy as np
import pytest
from scipy.io import savemat

from ssi_ros.bag import read_channels, write_samples
from ssi_ros.bag.table import load_table
from ssi_ros.cli.main import main
from ssi_ros.records import Samples

START = 1_700_000_000_000_000_000


def ssi(*words):
    """Run one verb; return its exit code."""
    return main([str(w) for w in words])


@pytest.fixture
def bag(tmp_path, rng):
    """Return a bag of two channels, 4 s, with 20 samples missing."""
    values = rng.standard_normal((400, 2))
    values[100:120, 1] = np.nan
    write_samples(tmp_path / 'bag', Samples(values, 100.0, ('a', 'b'), START),
                  extra={'seed': 3})
    return tmp_path / 'bag'


def test_info(bag, capsys):
    """Counts, rate, the gap and where it is, as text and as JSON."""
    assert ssi('info', bag) == 0
    text = capsys.readouterr().out
    assert '780 messages in 3.99 s' in text and 'seed: 3' in text
    assert '1 gap by receipt, the longest 0.210 s at 0.990 s' in text
    assert ssi('info', bag, '--json') == 0
    told = json.loads(capsys.readouterr().out)
    assert [t['messages'] for t in told['topics']] == [400, 380]
    assert told['topics'][0]['rate_hz'] == 100.0 and told['compression'] == ['zstd']
    assert ssi('info', bag / 'nothing') == 2
    assert 'does not exist' in capsys.readouterr().err


def test_recover(bag, tmp_path, capsys):
    """What was saved and lost, and the bag that comes of it."""
    path = bag / 'bag_0.mcap'
    path.write_bytes(path.read_bytes()[:-100])
    assert ssi('info', bag) == 2 and 'ssi_ros recover' in capsys.readouterr().err
    assert ssi('recover', bag) == 0
    text = capsys.readouterr().out
    assert '780 messages saved' in text and 'was cut off' in text
    assert ssi('info', tmp_path / 'bag_recovered') == 0


@pytest.mark.parametrize('suffix', ('csv', 'npz'))
def test_export_and_import_are_inverse(bag, tmp_path, capsys, suffix):
    """Stamps and values to the bit, also those of missing samples, through either format."""
    file = tmp_path / f'out.{suffix}'
    assert ssi('export', bag, '--output', file) == 0
    back = ('--time-column', 'stamp_ns') if suffix == 'csv' else (
        '--time-column', 'a_stamps_ns', '--columns', 'a_values', '--names', 'a')
    assert ssi('import', file, '--output', tmp_path / 'back', *back) == 0
    one, two = read_channels(bag), read_channels(tmp_path / 'back')
    for i in range(len(two.names)):
        assert np.array_equal(one.values[i], two.values[i])
        assert np.array_equal(one.stamps_ns[i], two.stamps_ns[i])
    assert ssi('export', bag, '--output', file) == 2
    assert 'never overwritten' in capsys.readouterr().err


@pytest.mark.parametrize('name, words', [
    ('out.xyz', 'ends in .npz'), ('there.csv', 'never overwritten'), ('out.uff', 'pip install')])
def test_export_looks_at_its_output_first(tmp_path, capsys, monkeypatch, name, words):
    """A file that cannot be written is said before a bag is opened: there is none here."""
    monkeypatch.setitem(sys.modules, 'pyuff', None)         # as where it is not installed
    (tmp_path / 'there.csv').touch()
    assert ssi('export', tmp_path / 'no_bag', '--output', tmp_path / name) == 2
    assert words in capsys.readouterr().err


def test_export_of_one_field(bag, tmp_path):
    """A field that is named is written, and only that."""
    file = tmp_path / 'out.npz'
    assert ssi('export', bag, '--output', file, '--channel', '/accelerometer/a:accel.linear.x'
               ) == 0
    with np.load(file) as f:
        assert set(f.files) == {'a.accel.linear.x_stamps_ns', 'a.accel.linear.x_values'}
        assert not f['a.accel.linear.x_values'].any()


def test_mat_and_npz(tmp_path, rng):
    """A matrix, its transpose, single variables and a time vector give the same samples."""
    values = rng.standard_normal((50, 3))
    time = 10.0 + np.arange(50) / 20.0
    savemat(tmp_path / 'm.mat', {'rz': values, 't': time, 'note': 'words'})
    np.savez(tmp_path / 'n.npz', a=values[:, 0], b=values[:, 1], t=time)
    np.savez(tmp_path / 'turned.npz', rz=values.T)
    whole = load_table(tmp_path / 'm.mat', variable='rz', rate_hz=20.0)
    assert np.array_equal(whole.values, values) and whole.channels == ('rz_0', 'rz_1', 'rz_2')
    timed = load_table(tmp_path / 'm.mat', variable='rz', time_column='t', columns=list('xyz'))
    # the slope over 49 periods of times rounded to 1 ns
    assert timed.rate_hz == pytest.approx(20.0, rel=1e-9) and timed.start_ns == 10 ** 10
    assert timed.channels == ('x', 'y', 'z')
    pair = load_table(tmp_path / 'n.npz', columns=['b', 'a'], rate_hz=20.0, scale=2.0)
    assert np.array_equal(pair.values, 2.0 * values[:, [1, 0]])
    with pytest.raises(ValueError, match='looks transposed'):
        load_table(tmp_path / 'turned.npz', rate_hz=20.0)
    turned = load_table(tmp_path / 'turned.npz', rate_hz=20.0, transpose=True)
    assert np.array_equal(turned.values, values)


@pytest.mark.parametrize('text, options, words', (
    ('a,b\n1,2\n3\n', {}, 'line 3: 1 cells, but the header has 2'),
    ('a,b\n1,2\n3,x\n', {}, "line 3, column b: 'x' is not a number"),
    ('1,2\n3,4\n', {}, 'a line of column names is needed'),
    ('a,a\n1,2\n3,4\n', {}, 'two columns of one name'),
    ('a,b\n1,2\n3,4\n', {'columns': ['c']}, "no column 'c'; it has a, b"),
    ('a,b\n1,2\n', {}, 'at least 2 are needed'),
    ('a,b\n1,\n2,\n', {}, 'b has no sample at all'),
    ('a,b\n1,2\n3,inf\n', {}, 'is infinite'),
    ('a,b\n1,2\n3,4\n', {'rate_hz': None}, 'neither rate_hz nor a time column'),
    ('t,a\n0,1\n1,2\n1,3\n', {'rate_hz': None, 'time_column': 't'}, 'row 2 does not rise'),
    ('t,a\n0,1\n1,2\n2,3\n3.4,3\n4,1\n', {'rate_hz': None, 'time_column': 't'},
     'off the even grid'),
    ('t,a\n0,1\n,2\n2,3\n', {'rate_hz': None, 'time_column': 't'}, 'every row needs one'),
    ('a,b\n1,2\n3,4\n', {'names': ['x']}, 'one a channel'),
    ('a,b\n1,2\n3,4\n', {'variable': 'q'}, 'no variables'),
    ('', {}, 'is empty')))
def test_a_table_that_does_not_fit_is_explained(tmp_path, text, options, words):
    """Ragged, wordy, headless, uneven, empty: where it is and what is needed."""
    (tmp_path / 'x.csv').write_text(text)
    with pytest.raises(ValueError, match=words):
        load_table(tmp_path / 'x.csv', **{'rate_hz': 100.0, **options})


def test_a_row_missing_from_the_time_column_is_missing_samples(tmp_path):
    """A hole in the times becomes NaN rows, and a slightly jittered clock is still even."""
    (tmp_path / 'x.csv').write_text('t,a\n0,1\n0.1,2\n0.4001,3\n0.5,4\n')
    samples = load_table(tmp_path / 'x.csv', time_column='t')
    assert np.isnan(samples.values[:, 0]).tolist() == [False, False, True, True, False, False]


def test_files_that_are_not_what_they_say(tmp_path):
    """Text named .npz or .mat, and a suffix nobody knows, give one line each."""
    for name, words in (('x.npz', 'cannot be read'), ('x.mat', 'cannot be read'),
                        ('x.txt', 'give a .csv')):
        (tmp_path / name).write_text('hello')
        with pytest.raises(ValueError, match=words):
            load_table(tmp_path / name, rate_hz=1.0)
