"""
What README, tutorial and how-tos show is what happens: their commands are run, their output held.

Blocks of `sh` are run in order, in a folder of their own beside the repository's files. A block of
`text` is what the block before it prints: in it a line `...` stands for any lines, `...` at the
end of a line for any rest, and `...` between words for any one word. What takes long, or needs
another machine, is only parsed; SLOW=1 in the environment runs what takes long too, as
`make test-slow` does with the two pages that are read first.
"""
import os
from pathlib import Path
import re
import shlex
import subprocess
import sys

import pytest

from ssi_ros.cli.main import main, parser

ROOT = Path(__file__).resolve().parent.parent
PAGES = ('README.md', 'docs/tutorial.md', *sorted(
    str(p.relative_to(ROOT)) for p in (ROOT / 'docs' / 'how-to').glob('*.md')))
QUICK = ('examples/shear_building.py', 'examples/footbridge.py')
LONG = ('diagnose', 'calibrate', 'identifiability', 'demo', 'place')             # verbs
# verbs that go on for ever, and one whose exit code is about this machine and what runs on it
RUNNING = ('monitor', 'bridge', 'play', 'record', 'doctor')
ELSEWHERE = ('ros2', 'rosdep', 'sudo', 'colcon', 'pip', 'cd', 'source', 'simulator_node',
             'identifier_node')


def blocks(page):
    """Return (language, lines) of every fenced block of a page."""
    return [(language, text.splitlines()) for language, text in re.findall(
        r'^```(\w+)\n(.*?)^```$', (ROOT / page).read_text(), re.M | re.S)]


def pattern(lines):
    """Return the pattern of shown output."""
    out = ''
    for line in lines:
        if line.strip() == '...':
            out += r'(?:.*\n)*?'
            continue
        words = re.escape(line.rstrip()).replace(re.escape('...'), r'\S+')
        if line.rstrip().endswith('...'):
            words = words.removesuffix(r'\S+') + '.*'
        out += words.replace(r'\ ', ' ') + r' *\n'
    return out


def run(command, capfd):
    """Run a command if it is quick and can be run here; return its output, None if it was not."""
    words = shlex.split(command, comments=True)
    name = Path(words[0]).name
    if name == 'make':
        assert f'\n{words[1]}:' in (ROOT / 'Makefile').read_text(), command
        # a machine with other work to do cannot keep up with ten times real time
        busy = os.getloadavg()[0] > 0.75 * os.cpu_count()
        if words[1] != 'demo' or not os.environ.get('SLOW') or busy:
            return None
        words = [sys.executable, '-m', 'ssi_ros', 'demo']
    if name in ELSEWHERE:
        return None
    if name == 'ssi_ros':
        parser().parse_args([w for w in words[1:] if w != '--help'] or ['--version']) \
            if '--help' not in words else None
        if words[1] in RUNNING or (words[1] in LONG and not os.environ.get('SLOW')):
            return None
        capfd.readouterr()
        code = main(words[1:]) if '--help' not in words else 0
        out, err = capfd.readouterr()
        assert code == 0, f'{command}: {err}'
        return out
    if name == 'python':
        if not os.environ.get('SLOW') and words[1] not in QUICK:     # their tests run them
            assert (ROOT / words[1]).is_file(), command
            return None
        words = [sys.executable, *words[1:]]
    done = subprocess.run(words, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, f'{command}: {done.stderr}'
    return done.stdout


@pytest.mark.parametrize('page', PAGES)
def test_page(page, tmp_path, monkeypatch, capfd):
    """Every command of the page works as printed, and prints what the page shows."""
    for name in ('bags', 'config', 'examples'):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    out = None
    for language, lines in blocks(page):
        if language == 'sh':
            outs = [run(line, capfd) for line in lines if line.strip()]
            out = None if None in outs else ''.join(outs)
        elif language == 'text' and out is not None:
            # the verbs print spaces at the ends of some lines
            assert re.match(pattern(lines), out), f'{page} shows\n{lines}\nbut it prints\n{out}'


@pytest.mark.parametrize('page', PAGES)
def test_verbs_and_pictures_exist(page):
    """Every verb that a page names exists, and every picture and file that it shows."""
    text = (ROOT / page).read_text()
    known = set(next(a for a in parser()._actions if a.dest == 'verb').choices)
    for verb in re.findall(r'`ssi_ros ([a-z]+)', text):
        assert verb in known, verb
    for target in re.findall(r'\]\(([^)#:]+)\)', text):
        assert ((ROOT / page).parent / target).exists(), target


def test_pattern_can_fail():
    """The comparison of shown and printed output takes nothing for granted."""
    assert re.match(pattern(['a ... c', '...', 'z = 1 ...']), 'a b c\nmore\n\nz = 1 +- 2\n')
    assert not re.match(pattern(['a ... c']), 'a b b c\n')
    assert not re.match(pattern(['z = 1 ...']), 'z = 2 +- 2\n')
    assert not re.match(pattern(['one']), 'one two\n')


@pytest.mark.slow
@pytest.mark.parametrize('page', PAGES[:2])
def test_what_takes_long_is_as_shown_too(page, tmp_path, monkeypatch, capfd):
    """Diagnoses, calibrations and their answers."""
    monkeypatch.setenv('SLOW', '1')
    test_page(page, tmp_path, monkeypatch, capfd)
