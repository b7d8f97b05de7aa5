"""The documentation as a site: built strictly, fetched from nowhere, and equal to the code."""
import os
from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / 'docs'


@pytest.fixture(scope='module')
def site(tmp_path_factory):
    """Build the site; a broken link or anchor would end the build."""
    pytest.importorskip('mkdocs', reason='MkDocs is not installed')
    pytest.importorskip('material', reason='the theme of the site is not installed')
    folder = tmp_path_factory.mktemp('site')
    done = subprocess.run(
        [sys.executable, '-m', 'mkdocs', 'build', '--strict', '--quiet', '--site-dir', folder],
        cwd=ROOT, capture_output=True, text=True, timeout=300,
        env=dict(os.environ, NO_MKDOCS_2_WARNING='1'))
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def test_site_fetches_nothing(site):
    """No page loads a script, a style, a font or a picture from the network."""
    pages = list(site.rglob('*.html'))
    assert len(pages) > 30
    for page in pages:
        outside = re.findall(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="?(?:https?:)?//[^>]+',
                             page.read_text())
        assert not outside, (page, outside)
    for sheet in site.rglob('*.css'):
        assert not re.search(r'url\(["\']?(?:https?:)?//', sheet.read_text()), sheet


def test_site_has_every_page(site):
    """Every Markdown file of docs/ is a page, and the lists of validation and decisions whole."""
    for source in DOCS.rglob('*.md'):
        assert (site / source.relative_to(DOCS)).with_suffix('.html').is_file(), source
    for folder in ('validation', 'decisions'):
        listed = set(re.findall(r'\]\(([\w-]+\.md)\)', (DOCS / folder / 'index.md').read_text()))
        there = {p.name for p in (DOCS / folder).glob('*.md')} - {'index.md'}
        assert there - listed == set(), f'docs/{folder}/index.md does not list these'


def test_reference_is_the_code(tmp_path):
    """Topics, parameters and verbs are what the code declares; `make docs` writes them anew."""
    pytest.importorskip('rclpy', reason='ROS 2 is not installed')
    done = subprocess.run([sys.executable, '-m', 'ssi_ros.ros.reference', tmp_path], cwd=ROOT,
                          capture_output=True, text=True, timeout=120,
                          env=dict(os.environ, ROS_LOG_DIR=str(tmp_path / 'log')))
    assert done.returncode == 0, done.stderr[-2000:]
    for name in ('topics.md', 'parameters.md', 'verbs.md'):
        assert (tmp_path / name).read_text() == (DOCS / 'reference' / name).read_text(), (
            f'docs/reference/{name} is not what the code says; run make docs')
