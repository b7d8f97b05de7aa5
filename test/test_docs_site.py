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
    # without --quiet, which hides warnings from --strict, too
    pytest.importorskip('mkdocs', reason='MkDocs is not installed')
    pytest.importorskip('material', reason='the theme of the site is not installed')
    pytest.importorskip('math_core', reason='what typesets equations is not installed')
    folder = tmp_path_factory.mktemp('site')
    done = subprocess.run(
        [sys.executable, '-m', 'mkdocs', 'build', '--strict', '--site-dir', folder],
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


def test_equations_are_typeset(site):
    """No page shows LaTeX; every numbered equation of the theory is MathML, with its anchor."""
    for page in site.rglob('*.html'):
        text = page.read_text()
        assert '$$' not in text and 'arithmatex' not in text, page
    for source in DOCS.glob('theory*.md'):
        numbers = re.findall(r'\\tag\{(\w+)\}', source.read_text())
        page = (site / source.name).with_suffix('.html').read_text()
        assert len(numbers) > 5
        assert re.findall(r'id="eq-(\w+)"><div><math', page) == numbers, source


def test_cited_equations_exist():
    """What the code cites as `eq. (105b)` is numbered in docs/theory*.md."""
    theory = ''.join(p.read_text() for p in DOCS.glob('theory*.md'))
    numbered = set(re.findall(r'\\tag\{(\w+)\}|\*\*\((\w+)\)\*\*', theory))
    numbered = {number for pair in numbered for number in pair if number}
    cited = {}
    for source in (ROOT / 'ssi_ros').rglob('*.py'):
        text = ' '.join(source.read_text().split())
        for found in re.findall(
                r"(?<!paper, )(?<!paper's )eq\. (\(\d\w*\)(?:(?:,| and| to) \(\d\w*\))*)", text):
            cited.update(dict.fromkeys(re.findall(r'\((\w+)\)', found), source.name))
    assert len(cited) > 100
    assert {n: f for n, f in cited.items() if n not in numbered} == {}


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
