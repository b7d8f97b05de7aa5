"""The verb that says what a record could tell."""
import json
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.cli._table import fitted
from ssi_ros.cli.main import main
from ssi_ros.report.parts import deviations


@pytest.mark.slow
def test_table_and_page(tmp_path, capsys):
    """Every effect has a row, mirrored places share one, and the page has the cosines."""
    files = {n: tmp_path / f'i.{n}' for n in ('html', 'json')}
    assert main(['identifiability', '--duration-s', '60',
                 *(w for n, f in files.items() for w in (f'--{n}', str(f)))]) == 0
    text = capsys.readouterr().out
    rows = text[:text.index('not distinguished')].splitlines()
    gains = [r for r in rows if r.startswith('sensor_gain ')]
    assert len(gains) == 1 and 'e1_a, e1_b, e2_a, e2_b' in gains[0]
    assert any(r.startswith('clock_rate ') for r in rows) and 'nan' not in text
    assert len({r.index("d' = 4") for r in rows[:1]}) == 1
    plain = json.loads(files['json'].read_text())
    names, matrix = plain['cosines']['effects'], np.array(plain['cosines']['matrix'])
    assert matrix.shape == (len(names),) * 2 and np.array_equal(matrix, matrix.T)
    assert np.all(np.diag(matrix) == 1.0) and matrix.max() <= 1.0 + 1e-9
    tied = matrix[names.index('stiffness_scale'), names.index('clock_rate')]
    assert tied > 0.9
    page = files['html'].read_text()
    assert 'id="cosines"' in page and all(n in page for n in names)


def test_a_terminal_cuts_rows_and_a_pipe_does_not(monkeypatch):
    """Rows do not wrap on a terminal of 80 columns; d' has no more digits than mean something."""
    monkeypatch.setenv('COLUMNS', '80')
    text = '\n'.join(['x' * 200, 'y' * 80])
    assert fitted(text, SimpleNamespace(isatty=lambda: False)) == text
    lines = fitted(text, SimpleNamespace(isatty=lambda: True)).split('\n')
    assert [len(line) for line in lines] == [80, 80] and lines[0].endswith('x…')
    assert [deviations(v) for v in (63688.2, 147.0, 7.84, float('nan'))] == [
        '63688', '147', '7.8', '-']


def test_too_short(capsys):
    """A second is not enough, and the message says what is."""
    assert main(['identifiability', '--duration-s', '1']) == 2
    assert 's are needed' in capsys.readouterr().err
