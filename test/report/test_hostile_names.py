"""Names out of a bag stay words in every page and table, and open no file elsewhere."""
from html.parser import HTMLParser
import json

import numpy as np
import pytest
from scipy.signal import lfilter
from ssi_ros.bag import BagWriter, read_channels
from ssi_ros.bag.export import export_recording
from ssi_ros.bag.samples import encode_accel
from ssi_ros.cli.main import main

NAMES = ('/<script>alert(1)</script>', '/../../x', '/a"b\'c', '/a\n# Forged | b', '/=1+1',
         '/$x_{$')
TAGS = {'script', 'img', 'iframe', 'a', 'base', 'object', 'svg', 'form'}


class Tags(HTMLParser):
    """Collect the tags of a page with their attributes."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Note a tag."""
        if tag in TAGS or any(k.startswith('on') for k, _ in attrs):
            self.found.append((tag, {k: v for k, v in attrs if k != 'd'}))


def own(found):
    """Return the tags that do not belong to a page of this package."""
    return [(t, a) for t, a in found
            if not (t == 'script' and set(a) <= {'type', 'id'})
            and not (t == 'a' and str(a.get('href', '')).startswith('#s'))]


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a bag whose topics have such names, in a folder that has one too."""
    folder = tmp_path_factory.mktemp('names') / '<img src=x onerror=alert(1)>'
    stamps = 10 ** 18 + np.arange(3000, dtype=np.int64) * 10_000_000
    rng = np.random.default_rng(4)
    beam = lfilter([1.0], [1.0, -1.8, 0.99], rng.standard_normal(len(stamps)))
    with BagWriter(folder) as writer:
        for name in NAMES:
            writer.add_topic(name, 'geometry_msgs/msg/AccelStamped')
            values = beam + 0.1 * rng.standard_normal(len(stamps))
            for stamp, raw in zip(stamps.tolist(), encode_accel(stamps, values, name)):
                writer.write(name, bytes(raw), stamp, stamp)
    return folder


def everything(folder):
    """Return all files below a folder."""
    return {p for p in folder.rglob('*') if p.is_file()}


def test_pages_show_names_as_words(bag, tmp_path, capsys):
    """Report, plots, tables and JSON of an identification: no tag, no file elsewhere."""
    before = everything(bag.parent)
    out = tmp_path / 'deep' / 'er'
    out.mkdir(parents=True)
    assert main(['report', str(bag), '--output', str(out / 'a.html')]) == 0
    assert main(['identify', str(bag), '--plot', str(out / 'plots'), '--window-s', '20',
                 '--json', str(out / 'a.json')]) == 0
    for page in (out / 'a.html', out / 'plots' / 'index.html'):
        text = page.read_text()
        assert own(Tags(text).found) == []
        assert '<script>alert' not in text
    json.loads((out / 'a.json').read_text())
    assert all(p.is_relative_to(out) for p in everything(tmp_path))
    assert everything(bag.parent) == before
    capsys.readouterr()
    assert main(['info', str(bag)]) == 0
    assert not any(line.startswith('# Forged') for line in capsys.readouterr().out.splitlines())


def test_exports_stay_in_their_file(bag, tmp_path):
    """A CSV has one row for the heads; no entry of an NPZ names a place outside of it."""
    recording = read_channels(bag)
    export_recording(recording, tmp_path / 'a.csv')
    export_recording(recording, tmp_path / 'a.npz')
    with np.load(tmp_path / 'a.npz') as file:
        names = file.files
    assert not [n for n in names if n.startswith('/') or '..' in n.split('/')], names
    assert {p.name for p in tmp_path.iterdir()} == {'a.csv', 'a.npz'}
