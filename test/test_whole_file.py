"""Files that are whole or not there, and errors that name them."""
import os
import subprocess
import sys

import numpy as np
import pytest
from ssi_ros.bag import write_samples
from ssi_ros.records import Samples
from ssi_ros.whole_file import whole_file, write_whole

# A child whose files cannot grow beyond 4 kB, as on a full disk. What it compiled would be cut off
# there as well, and would stay: nobody could import it any more.
LIMITED = """
import resource, signal, sys
sys.dont_write_bytecode = True
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
from ssi_ros.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def test_an_error_leaves_what_was_there(tmp_path):
    """A block that fails, whatever of, leaves the old file and no draft."""
    path = tmp_path / 'a.csv'
    write_whole(path, 'old')
    with pytest.raises(ValueError, match='halfway'), whole_file(path) as file:
        file.write('ne')
        raise ValueError('halfway')
    assert path.read_text() == 'old' and list(tmp_path.iterdir()) == [path]
    write_whole(path, 'new')
    assert path.read_text() == 'new' and list(tmp_path.iterdir()) == [path]


def test_links_modes_and_devices_stay(tmp_path):
    """The file that a link names is replaced, its mode is kept, a device is written to."""
    path, link = tmp_path / 'a', tmp_path / 'link'
    path.write_text('old')
    path.chmod(0o640)
    link.symlink_to(path)
    write_whole(link, 'new')
    assert link.is_symlink() and path.read_text() == 'new'
    assert path.stat().st_mode & 0o777 == 0o640
    write_whole('/dev/null', 'gone')
    assert not os.path.isfile('/dev/null')
    with pytest.raises(OSError) as caught:
        write_whole('/dev/full', 'x')
    assert caught.value.filename == '/dev/full'


@pytest.mark.parametrize('words, name', [
    (['export', 'bag', '--output', 'a.csv'], 'a.csv'),
    (['export', 'bag', '--output', 'a.npz'], 'a.npz'),
    (['model', '--npz', 'm.npz'], 'm.npz'),
    (['identify', 'bag', '--window-s', '10', '--hop-s', '0.2', '--json', 'w.json'], 'w.json')])
def test_a_full_disk_leaves_no_part_of_a_file(tmp_path, words, name):
    """Verbs end with one line that names the file; nothing stands under its name."""
    values = np.random.default_rng(1).standard_normal((3000, 2))
    write_samples(tmp_path / 'bag', Samples(values, 100.0, ('a', 'b'), 10 ** 18))
    done = subprocess.run([sys.executable, '-c', LIMITED, *words], cwd=tmp_path, text=True,
                          capture_output=True, env={**os.environ, 'NO_COLOR': '1'})
    assert done.returncode == 2 and 'Traceback' not in done.stderr, done.stderr
    assert f'{name}: File too large' in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ['bag']
