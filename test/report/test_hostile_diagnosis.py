"""Names out of models and bags stay words in diagnoses, calibrations and tables of many bags."""
import json
import urllib.error
import urllib.request

import numpy as np
import pytest
from ssi_ros.bag import BagWriter, encode_accel
from ssi_ros.cli.main import main
from ssi_ros.effects import inject, simulate_setup
from ssi_ros.model import load_model
from test_hostile_names import everything, own, Tags

CHANNELS = ('<script>alert(1)</script>', 'a"b\'c | <img src=x onerror=alert(2)>')
INPUT = '../x</title><script>alert(3)</script>'
MODEL = {'channels': CHANNELS, 'kinds': ['acceleration', 'acceleration'], 'noise_rms': 1e-3,
         'inputs': [INPUT], 'levels': 2.0, 'rate_hz': 20.0, 'mass': np.eye(2),
         'damping_ratios': 0.02, 'stiffness': [[2000.0, -1000.0], [-1000.0, 1000.0]],
         'input': [[0.0], [1.0]], 'output': np.eye(2), 'freedoms': ['<b>f</b>', '../g | `h`'],
         'uncertainty_frequency': 0.01}
TOPICS = ('/<script>alert(4)</script>', '/a\n# Forged | b')


def write_bag(path, samples):
    """Write a bag with hostile names of topics and frames."""
    with BagWriter(path) as bag:
        for topic, column in zip(TOPICS, samples.values.T):
            bag.add_topic(topic, 'geometry_msgs/msg/AccelStamped')
            stamps = samples.stamps_ns() + 10 ** 18
            for stamp, raw in zip(stamps.tolist(), encode_accel(stamps, column, topic)):
                bag.write(topic, bytes(raw), stamp, stamp)
    return path


@pytest.fixture(scope='module')
def given(tmp_path_factory):
    """Return a model with hostile names, a healthy bag, and one whose first channel is wrong."""
    folder = tmp_path_factory.mktemp('given')
    np.savez(folder / 'm.npz', **MODEL)
    model, _ = load_model(folder / 'm.npz')
    healthy, wrong = (simulate_setup(inject(model, (), 200.0), seed) for seed in (1, 2))
    wrong.values.flags.writeable = True
    wrong.values[:, 0] *= 1.3
    many = folder / 'many'
    many.mkdir()
    return (folder, write_bag(folder / '<img src=x onerror=alert(5)>', healthy),
            write_bag(many / '=1+1\n# Forged <script>alert(6)<', wrong))


def checked(page):
    """Check that a page has no tag and no handler but its own."""
    text = page.read_text()
    assert own(Tags(text).found) == []
    assert '<script>alert' not in text and '<img src=x' not in text


def no_forged_line(text):
    """Check that no line of a terminal or of Markdown begins with a name's own words."""
    assert not [line for line in text.splitlines() if line.startswith('# Forged')]


@pytest.mark.parametrize('nominal', ('model', 'reference'))
def test_diagnosis(given, tmp_path, capsys, nominal):
    """Terminal, page, Markdown and JSON of a diagnosis beside a model and beside a recording."""
    folder, healthy, wrong = given
    beside = (['--model', str(folder / 'm.npz'), *sum((['--channel', t] for t in TOPICS), [])]
              if nominal == 'model' else ['--reference', str(healthy)])
    before = everything(folder)
    main(['diagnose', str(wrong), *beside, '--no-pairs', '--html', str(tmp_path / 'a.html'),
          '--markdown', str(tmp_path / 'a.md'), '--json', str(tmp_path / 'a.json')])
    said = capsys.readouterr()
    no_forged_line(said.out + said.err)
    checked(tmp_path / 'a.html')
    markdown = (tmp_path / 'a.md').read_text()
    no_forged_line(markdown)
    plain = markdown.split('```')[0].replace('\\<', '')
    assert '<script>' not in plain and '<img' not in plain
    found = json.loads((tmp_path / 'a.json').read_text())
    # beside the recording the gain has its candidates, whose words hold names
    assert found['outcome'] == 'EXPLAINED' or nominal == 'model'
    assert everything(folder) == before


def test_calibration(given, tmp_path, capsys):
    """Terminal, page and file of a calibration."""
    folder, healthy, _ = given
    assert main(['calibrate', str(healthy), '--model', str(folder / 'm.npz'), '--output',
                 str(tmp_path / 'c.npz'), '--html', str(tmp_path / 'c.html'),
                 *sum((['--channel', t] for t in TOPICS), [])]) == 0
    said = capsys.readouterr()
    no_forged_line(said.out + said.err)
    checked(tmp_path / 'c.html')
    assert {p.name for p in tmp_path.iterdir()} == {'c.npz', 'c.html'}


@pytest.mark.slow
def test_many_bags(given, tmp_path, capsys):
    """The table on the terminal and in CSV: one line a bag, and no formula of a spreadsheet."""
    pytest.importorskip('dask.distributed')
    pytest.importorskip('cryptography')
    folder, healthy, wrong = given
    before = everything(folder)
    main(['diagnose', '--many', str(wrong.parent), '--reference', str(healthy), '--no-pairs',
          '--workers', '1', '--json', str(tmp_path / 'answers')])
    said = capsys.readouterr()
    no_forged_line(said.out + said.err)
    table = (tmp_path / 'answers' / 'diagnoses.csv').read_text()
    assert not [line for line in table.splitlines() if line.startswith(('=', '"=', '# '))], table
    assert everything(folder) == before


@pytest.mark.parametrize('name', ('\x1b[31mred', 'a\n# Forged', '\u202egnp.x'))
@pytest.mark.parametrize('kind', ('channels', 'inputs', 'freedoms'))
def test_names_of_a_model_that_do_not_print_are_refused(tmp_path, kind, name):
    """An escape of the terminal, the end of a line, a turn of the direction of writing."""
    np.savez(tmp_path / 'm.npz', **{**MODEL, kind: [name, *MODEL[kind][1:]]})
    with pytest.raises(ValueError, match='holds what does not print') as error:
        load_model(tmp_path / 'm.npz')
    assert str(error.value).isprintable()


def test_own_cluster_serves_no_page():
    """Dask listens on the loopback alone, its web servers have no route, and it takes no work."""
    distributed = pytest.importorskip('dask.distributed')
    pytest.importorskip('cryptography')
    from ssi_ros.cli._many import own_cluster
    cluster = own_cluster(1)
    try:
        (worker,) = cluster.scheduler_info['workers'].values()
        places = [s.getsockname() for s in cluster.scheduler.http_server._sockets.values()]
        assert cluster.scheduler_address.startswith('tls://127.0.0.1:')
        assert worker['nanny'].startswith('tls://127.0.0.1:') and places
        assert all(p[0] == '127.0.0.1' for p in places)
        for port in (places[0][1], worker['services']['dashboard']):
            for page in ('', 'status', 'info/main/workers.html', 'json/counts.json', 'metrics'):
                with pytest.raises(urllib.error.HTTPError, match='404'):
                    urllib.request.urlopen(f'http://127.0.0.1:{port}/{page}', timeout=10.0)
        with distributed.Client(cluster) as client:
            assert client.submit(sum, (1, 2)).result(timeout=30.0) == 3
        # whoever has no certificate, or another one than that of the command
        outsiders = (cluster.scheduler_address.replace('tls:', 'tcp:'), None), (
            cluster.scheduler_address, distributed.Security.temporary())
        for address, security in outsiders:
            with pytest.raises(OSError):
                distributed.Client(address, security=security, timeout='3s')
    finally:
        cluster.close()


@pytest.mark.parametrize('text', (
    'sensor_gain:channel=<script>alert(1)</script>,scale=1.1', '<script>alert(1)</script>',
    'sensor_gain:channel=e1_a,<b>=1', '../../x:scale=1', '\x1b[31mred:scale=1'))
def test_texts_of_effects_are_refused_in_one_line(tmp_path, capsys, text):
    """What names no effect or no channel is quoted with what does not print escaped."""
    assert main(['simulate', str(tmp_path / 'bag'), '--duration-s', '1', '--effect', text]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1 and said.isprintable() or said[:-1].isprintable(), said
    assert not list(tmp_path.iterdir())
