"""Options and tables that ask for too much: a sentence before the work, never a crash."""
import io
import struct
import sys
import zipfile

import numpy as np
import pytest
from scipy.io import savemat

from ssi_ros.bag.table import load_table
from ssi_ros.cli.main import main


def refused(capsys, *words):
    """Run a verb that has to end with 2; return its words."""
    try:
        assert main([str(w) for w in words]) == 2
    except SystemExit as end:                 # of an option that is out of its bounds
        assert end.code == 2
    return capsys.readouterr().err


@pytest.fixture
def csv(tmp_path):
    """Return a sound CSV of 100 rows."""
    path = tmp_path / 'x.csv'
    path.write_text('t,a\n' + ''.join(f'{i / 100},{i}\n' for i in range(100)))
    return path


@pytest.mark.parametrize('options', (
    ('--rate-hz', '0'), ('--rate-hz', 'inf'), ('--rate-hz', '1e7'), ('--rate-hz', 'nan'),
    ('--scale', 'nan'), ('--scale', 'inf'), ('--scale', '0'), ('--start-s', 'inf'),
    ('--start-s', '-1'), ('--start-s', '3e9'), ('--names', '../x'), ('--names', 'a b'),
    ('--columns', ','), ('--time-column', 'none')))
def test_import_refuses(csv, tmp_path, capsys, options):
    """Rates, factors, stamps and names out of their bounds."""
    rate = () if '--rate-hz' in options else ('--rate-hz', '100')
    words = refused(capsys, 'import', csv, '--output', tmp_path / 'bag', *rate, *options)
    assert words and not (tmp_path / 'bag').exists()


@pytest.mark.parametrize('verb, options', (
    ('simulate', ('--duration-s', '1e12')), ('simulate', ('--duration-s', '1e9')),
    ('simulate', ('--duration-s', 'nan')), ('simulate', ('--start-s', 'inf')),
    ('simulate', ('--rate-hz', '0')), ('identify', ('--rate-hz', 'inf')),
    ('identify', ('--rate-hz', '1e7')), ('identify', ('--start-s', 'inf')),
    ('identify', ('--lateness-s', 'nan')), ('play', ('--rate', '0')),
    ('play', ('--start-s', '-1')), ('play', ('--duration-s', 'inf'))))
def test_options_have_bounds(tmp_path, capsys, verb, options):
    """A number that no record can need is refused by its option, or by the memory it needs."""
    words = refused(capsys, verb, tmp_path / 'bag', *options)
    assert any(w in words for w in ('needed', 'needs about', 'must be')), words


@pytest.mark.parametrize('times, words', (
    ([0, 1, 2, 10 ** 9], 'spread over'), ([0, 1, 2, 1e300], 'no time'),
    ([-3, -2, -1], '1970'), ([0, 1e-12, 2e-12], 'does not rise')))
def test_times_with_a_huge_step_are_refused(tmp_path, times, words):
    """One step of thirty years in a table of three rows, and times that are none."""
    path = tmp_path / 'x.csv'
    path.write_text('t,a\n' + ''.join(f'{t!r},1\n' for t in times))
    if words == 'spread over':
        path.write_text('t,a\n' + ''.join(f'{t / 1000!r},1\n' for t in range(50)) + '1e9,1\n')
    with pytest.raises(ValueError, match=words):
        load_table(path, time_column='t')


def test_very_many_columns_are_refused(tmp_path):
    """A hundred thousand columns, in a CSV and in an array."""
    (tmp_path / 'x.csv').write_text(','.join(f'c{i}' for i in range(100_000)) + '\n')
    np.savez(tmp_path / 'x.npz', a=np.zeros((4, 100_000)))
    for name in ('x.csv', 'x.npz'):
        with pytest.raises(ValueError, match='columns'):
            load_table(tmp_path / name, rate_hz=1.0)


def npz(path, header, data=b'', size=0):
    """Write an NPZ whose array has a header of one's own, and zeros behind it."""
    head = header.encode('latin1')
    with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as file:
        with file.open('a.npy', 'w', force_zip64=True) as member:
            member.write(b'\x93NUMPY\1\0' + struct.pack('<H', len(head)) + head + data)
            for _ in range(size >> 20):
                member.write(bytes(1 << 20))


@pytest.mark.parametrize('header, size', (
    ("{'descr': '<f8', 'fortran_order': False, 'shape': (536870912,)}", 0),
    ("{'descr': '<f8', 'fortran_order': False, 'shape': (16777216, 4)}", 1 << 29),
    ("{'descr': '<f8', 'fortran_order': False, 'shape': (-5, 2)}", 0),
    ("{'descr': '<f8', 'fortran_order': False, 'shape': (1e5,)}", 0),
    ("{'descr': '|O', 'fortran_order': False, 'shape': (4,)}", 0),
    ("{'descr': '<f8', 'shape': ()}", 0), ('(' * 5000, 0), ("__import__('os')", 0), ('', 0)))
def test_an_npz_that_lies_is_refused(tmp_path, header, size):
    """Shapes that are not there, 512 MiB of zeros in 500 kB, objects, code."""
    npz(tmp_path / 'x.npz', header, size=size)
    with pytest.raises(ValueError) as error:
        load_table(tmp_path / 'x.npz', rate_hz=1.0)
    assert len(str(error.value).splitlines()) == 1


def test_damaged_archives_are_refused(tmp_path, rng):
    """Bytes of an NPZ and of a MAT file overwritten anywhere: samples, or a sentence."""
    values = rng.standard_normal((50, 2))
    np.savez_compressed(tmp_path / 'x.npz', a=values)
    data = (tmp_path / 'x.npz').read_bytes()
    for i in range(200):
        bad = bytearray(data)
        for at in rng.integers(0, len(data), 1 + i // 20):
            bad[at] = rng.integers(256)
        (tmp_path / 'y.npz').write_bytes(bad)
        try:
            assert np.array_equal(load_table(tmp_path / 'y.npz', rate_hz=1.0).values, values)
        except ValueError as error:
            assert len(str(error).splitlines()) == 1
    stream = io.BytesIO()
    savemat(stream, {'a': values}, do_compression=True)
    data = stream.getvalue()
    for i in range(6):
        bad = bytearray(data)
        for at in rng.integers(128, len(data), 1 + i):
            bad[at] = rng.integers(256)
        (tmp_path / 'y.mat').write_bytes(bad)
        try:
            load_table(tmp_path / 'y.mat', rate_hz=1.0)
        except ValueError as error:
            assert len(str(error).splitlines()) == 1


def test_a_mat_file_that_crashes_its_reader_is_refused(tmp_path, monkeypatch):
    """The process that reads it ends by a signal; this one says so."""
    python = tmp_path / 'python'
    python.write_text('#!/bin/sh\nkill -SEGV $$\n')
    python.chmod(0o755)
    savemat(tmp_path / 'x.mat', {'a': np.zeros((4, 2))})
    monkeypatch.setattr(sys, 'executable', str(python))
    with pytest.raises(ValueError, match='crashes the reader'):
        load_table(tmp_path / 'x.mat', rate_hz=1.0)


@pytest.mark.parametrize('text, words', (
    ('rate_hz: [100, 200]', 'one value, not several'), ('rate_hz: {a: 1}', 'must be a number'),
    ('[' * 100_000, 'deeper'), ('- 1', 'must be a mapping'), ('hub: 3', 'must be a mapping'),
    ('rate_hz: words', 'must be a number'), ('arrays: 7', 'mapping'), ('\xff\xfe', 'YAML'),
    ('a: &a [*a]', 'alias'), ('rate_hz: .nan', 'outside'), ('', 'must be a mapping')))
def test_a_spacecraft_that_is_none_is_refused(tmp_path, capsys, text, words):
    """A list for a number, deep nesting, what is no mapping: one sentence that names it."""
    path = tmp_path / 'x.yaml'
    path.write_bytes(text.encode('latin1'))
    said = refused(capsys, 'simulate', tmp_path / 'bag', '--model', path)
    assert words in said and len(said.splitlines()) == 1, said


def test_values_that_a_file_leaves_out_are_listed(tmp_path, capsys):
    """What is not in the file is taken from the package, and this is said."""
    (tmp_path / 'x.yaml').write_text('rate_hz: 100\nsensors: [{name: s, array: E1}]\n')
    assert main(['simulate', str(tmp_path / 'bag'), '--duration-s', '1', '--model',
                 str(tmp_path / 'x.yaml')]) == 0
    said = capsys.readouterr().err
    assert 'sensors.0.along_m' in said and 'rate_hz' not in said.replace('x.yaml', ''), said


def test_the_lowest_frequency_has_to_be_below_the_highest(tmp_path):
    """A low_hz above Nyquist is named, and not the length of the record."""
    from ssi_ros.gap.settings import DiagnosisSettings
    from ssi_ros.gap.spectra.segmentation import make_frame
    with pytest.raises(ValueError, match='low_hz=70 is not below'):
        make_frame(100_000, 100.0, DiagnosisSettings(low_hz=70.0))
