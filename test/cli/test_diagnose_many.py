"""`diagnose --many`: a folder of bags on Dask, resumed after a kill, with a bad bag among them."""
import csv
import errno
import json
import os
import signal
import subprocess
import sys
import time

import pytest
from ssi_ros.bag import write_samples
from ssi_ros.cli import _many
from ssi_ros.cli.main import main
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.model import load_spacecraft

pytest.importorskip('dask.distributed', reason='Dask is not installed')
pytest.importorskip('cryptography', reason='no certificate can be made')
FEW = 'sensor_gain,sensor_noise'
PATIENCE_S = 300.0


def make_bags(folder, count, duration_s=60.0):
    """Write bags, every second one with an effect, the last one empty of samples."""
    folder.mkdir()
    for k in range(count):
        effects = [parse_effect('sensor_gain:channel=e1_b,scale=1.2')] if k % 2 else []
        samples = simulate_setup(inject(load_spacecraft(), effects, duration_s), 50 + k)
        write_samples(folder / f'bag_{k}', samples)
    (folder / 'broken').mkdir()
    (folder / 'broken' / 'broken_0.mcap').write_bytes(b'no bag at all')


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return a folder with four bags and a broken one."""
    folder = tmp_path_factory.mktemp('many') / 'bags'
    make_bags(folder, 4)
    return folder


def command(bags, *more):
    """Return the words of the command on a folder."""
    return ['diagnose', '--many', str(bags), '--effects', FEW, '--no-pairs', *more]


@pytest.mark.slow
def test_all_bags_and_again(bags, tmp_path, capsys):
    """A row and a JSON a bag, the broken one as a row; a second run does the broken one only."""
    out = tmp_path / 'out'
    assert main(command(bags, '--json', str(out), '--workers', '2')) == 1
    said = capsys.readouterr().out
    assert '5 bags' in said and '0 of them diagnosed before' in said and '1 ERROR' in said
    with open(out / 'diagnoses.csv', newline='') as file:
        rows = {r['bag']: r for r in csv.DictReader(file)}
    assert list(rows) == ['bag_0', 'bag_1', 'bag_2', 'bag_3', 'broken']
    assert rows['broken']['outcome'] == 'ERROR' and rows['broken']['reason']
    for name in ('bag_1', 'bag_3'):
        assert rows[name]['effect'] == 'sensor_gain' and float(rows[name]['probability']) > 0.5
        found = json.loads((out / f'{name}.json').read_text())
        assert found['schema'] == 'ssi_ros/diagnosis/1' and found['bag'] == name
    before = {p.name: p.stat().st_mtime_ns for p in out.glob('bag_*.json')}
    assert main(command(bags, '--json', str(out), '--workers', '1')) == 1
    assert '4 of them diagnosed before' in capsys.readouterr().out
    assert before == {p.name: p.stat().st_mtime_ns for p in out.glob('bag_*.json')}
    assert main(command(bags, '--json', str(out), '--settings', str(bags))) == 2
    assert main([*command(bags, '--json', str(out))[:-5], '--json', str(out)]) == 2
    assert 'another folder with --json' in capsys.readouterr().err


@pytest.mark.slow
def test_it_goes_on_after_a_kill(bags, tmp_path):
    """Killed in the midst: what was written is whole and is kept, the rest is done once."""
    out = tmp_path / 'out'
    words = [sys.executable, '-m', 'ssi_ros', *command(bags, '--json', str(out), '--workers', '1')]
    first = subprocess.Popen(words, start_new_session=True, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL)
    end = time.monotonic() + PATIENCE_S
    while not list(out.glob('bag_*.json')):
        assert time.monotonic() < end and first.poll() is None
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    kept = {p: p.stat().st_mtime_ns for p in out.glob('bag_*.json')}
    for path in kept:
        json.loads(path.read_text())
    second = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)
    assert f'{len(kept)} of them diagnosed before' in second.stdout, second.stderr
    # what a cluster says as it ends is no news
    assert 'distributed' not in second.stderr and 'Traceback' not in second.stderr
    assert len(list(out.glob('bag_*.json'))) == 4
    assert all(p.stat().st_mtime_ns == stamp for p, stamp in kept.items())


@pytest.mark.slow
def test_given_scheduler(bags, tmp_path):
    """Scheduler and worker started as processes of their own do the work."""
    contact = tmp_path / 'scheduler.json'
    here = {'env': dict(os.environ), 'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL}
    started = [subprocess.Popen([sys.executable, '-m', 'distributed.cli.dask_scheduler', '--port',
                                 '0', '--no-dashboard', '--scheduler-file', str(contact)], **here)]
    try:
        end = time.monotonic() + PATIENCE_S
        while not contact.exists():
            assert time.monotonic() < end and started[0].poll() is None
            time.sleep(0.1)
        time.sleep(0.5)
        address = json.loads(contact.read_text())['address']
        started.append(subprocess.Popen(
            [sys.executable, '-m', 'distributed.cli.dask_worker', address, '--nthreads', '1',
             '--no-dashboard', '--local-directory', str(tmp_path)], **here))
        done = subprocess.run(
            [sys.executable, '-m', 'ssi_ros',
             *command(bags, '--json', str(tmp_path / 'out'), '--scheduler', address)],
            capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 1 and '1 ERROR' in done.stdout, done.stderr
        assert len(list((tmp_path / 'out').glob('bag_*.json'))) == 4
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(timeout=30)


def test_links_to_bags_are_followed(bags, tmp_path):
    """A pass may be a link to another disk; one that leads back up ends nowhere."""
    (tmp_path / 'deep').mkdir()
    for k in (1, 0):
        (tmp_path / 'deep' / f'pass_{k}').symlink_to(bags / f'bag_{k}')
    (tmp_path / 'deep' / 'back').symlink_to(tmp_path)
    (tmp_path / 'answers').symlink_to(bags)
    found = _many.find_bags(tmp_path, tmp_path / 'answers')
    assert list(found) == ['deep/pass_0', 'deep/pass_1']


def test_a_file_is_whole_or_not_there(tmp_path, monkeypatch):
    """A fault while writing leaves the old file; the draft has another name."""
    path = tmp_path / 'a.json'
    _many.write_whole(path, 'old')

    def full(*_):
        raise OSError(errno.ENOSPC, 'full')
    monkeypatch.setattr('os.replace', full)
    with pytest.raises(OSError, match=str(path)):
        _many.write_whole(path, 'new')
    assert path.read_text() == 'old' and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize('words, told', [
    (['diagnose'], 'give one bag, or --many'),
    (['diagnose', 'bag', '--many', '.'], 'give one bag, or --many'),
    (['diagnose', '--many', '/no/such'], 'is not a folder'),
    (['diagnose', '--many', '{empty}'], 'holds no bags'),
    (['diagnose', '--many', '{bags}', '--effects', 'sensor_gian'], 'did you mean sensor_gain'),
    (['diagnose', '--many', '{bags}', '--apply', 'x.yaml'], '--apply belongs to a single bag'),
    (['diagnose', 'bag', '--workers', '2'], 'belong to --many')])
def test_mistakes_are_told(bags, tmp_path, capsys, words, told):
    """One line, exit code 2."""
    words = [w.format(empty=tmp_path, bags=bags) for w in words]
    assert main(words) == 2
    assert told in capsys.readouterr().err
