"""What all verbs share: outputs checked first, --quiet, --overwrite, help, completion."""
import contextlib
import fcntl
import os
import pty
import shutil
import struct
import subprocess
import sys
import termios
import time

import pytest
from ssi_ros.cli.main import main, parser, verbs
from ssi_ros.quantity import things

SIMULATE = ('--duration-s', '20', '--seed', '3')


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a short bag."""
    path = tmp_path_factory.mktemp('bags') / 'bag'
    assert main(['simulate', str(path), *SIMULATE, '--quiet']) == 0
    return path


@pytest.mark.parametrize('words', [
    ('report', '{bag}', '--output', '{tmp}/no/page.html'),
    ('identify', '{bag}', '--json', '{tmp}/no/modes.json'),
    ('export', '{bag}', '--output', '{tmp}/no/x.npz'),
    ('report', '{tmp}/no_bag_at_all', '--output', '{tmp}/no/page.html')])
def test_outputs_are_checked_before_the_work(bag, tmp_path, capsys, words):
    """A folder that is not there is refused before anything is read; it names the option."""
    assert main([w.format(bag=bag, tmp=tmp_path) for w in words]) == 2
    out, err = capsys.readouterr()
    assert not out and 'the folder' in err and 'does not exist; make it first' in err


def test_a_folder_is_no_file(bag, tmp_path, capsys):
    """An output that is a folder is refused with a way out."""
    assert main(['report', str(bag), '--output', str(tmp_path)]) == 2
    assert 'is a folder; name a file' in capsys.readouterr().err


def test_quiet_prints_nothing_and_works(bag, tmp_path, capsys):
    """With --quiet the file is written and nothing is printed; an error still is."""
    assert main(['export', str(bag), '--output', str(tmp_path / 'x.npz'), '--quiet']) == 0
    assert capsys.readouterr() == ('', '') and (tmp_path / 'x.npz').stat().st_size > 1000
    assert main(['export', str(bag), '--output', str(tmp_path / 'y.npz')]) == 0
    assert 'e1_a: 2000 samples' in capsys.readouterr().out
    assert main(['info', str(tmp_path / 'none'), '--quiet']) == 2
    assert 'does not exist' in capsys.readouterr().err


def test_overwrite_replaces_a_bag_and_nothing_else(tmp_path, capsys):
    """A bag is replaced if that is asked for, and another folder never."""
    bag = str(tmp_path / 'bag')
    assert main(['simulate', bag, *SIMULATE]) == 0
    assert main(['simulate', bag, *SIMULATE]) == 2
    assert 'exists; give another name, or --overwrite' in capsys.readouterr().err
    stale = tmp_path / 'bag' / 'stale'      # a file in the folder that is replaced
    stale.write_text('')
    assert main(['simulate', bag, *SIMULATE, '--overwrite']) == 0
    assert not stale.exists()
    (tmp_path / 'work').mkdir()
    (tmp_path / 'work' / 'thesis.txt').write_text('years')
    assert main(['simulate', str(tmp_path / 'work'), *SIMULATE, '--overwrite']) == 2
    assert 'is no bag' in capsys.readouterr().err
    assert (tmp_path / 'work' / 'thesis.txt').read_text() == 'years'


def test_help_of_a_verb(capsys):
    """`help VERB` is `VERB --help`."""
    with pytest.raises(SystemExit) as end:
        main(['help', 'info'])
    assert end.value.code == 0 and 'usage: ssi_ros info' in capsys.readouterr().out


def test_the_shell_completes():
    """A shell that asks through argcomplete gets the verbs and the options of a verb."""
    pytest.importorskip('argcomplete')
    code = 'from ssi_ros.cli.main import main; main()'

    def ask(line):
        done = subprocess.run(
            [sys.executable, '-c', 'import os; os.dup2(1, 8); ' + code], capture_output=True,
            text=True, env={**os.environ, '_ARGCOMPLETE': '1', 'COMP_LINE': line,
                            'COMP_POINT': str(len(line)), '_ARGCOMPLETE_IFS': ' ',
                            '_ARGCOMPLETE_SUPPRESS_SPACE': '1'})
        return done.stdout.split()
    assert 'doctor' in ask('ssi_ros do') and 'simulate' not in ask('ssi_ros do')
    assert '--overwrite' in ask('ssi_ros simulate --over')


def test_one_is_singular():
    """One channel, four channels."""
    assert things(1, 'channel') == '1 channel' and things(4, 'channel') == '4 channels'


def test_values_of_options_are_named_by_their_units():
    """No value is called after its option or its type: seconds are S, hertz HZ, counts N."""
    for name in verbs():
        for action in parser(name)._subparsers._group_actions[0].choices[name]._actions:
            if action.option_strings and action.nargs != 0 and not action.choices:
                named = action.metavar in (None, 'FLOAT', 'INT', 'STR') or '_' in action.metavar
                assert not named, (name, action.option_strings)
            if action.dest.endswith(('_s', '_hz')):
                assert action.metavar in ('S', 'HZ'), (name, action.option_strings)


def on_a_terminal(code, **environment):
    """Return what a program writes on a terminal in its first 4 s, and until its end."""
    main_end, program_end = pty.openpty()
    fcntl.ioctl(program_end, termios.TIOCSWINSZ, struct.pack('4H', 24, 80, 0, 0))
    done = subprocess.Popen([sys.executable, '-c', code], stdout=program_end, stderr=program_end,
                            env={**os.environ, 'TERM': 'xterm', **environment})
    os.close(program_end)
    early, text, begin = '', '', None
    with contextlib.suppress(OSError):          # EIO: the program has ended
        while data := os.read(main_end, 4096).decode():
            begin = begin or time.monotonic()
            text += data
            early = text if time.monotonic() < begin + 4.0 else early
    os.close(main_end)
    assert done.wait(timeout=60) == 0, text
    return early, text


def test_progress_from_the_first_second():
    """A step that reports nothing has a bar while it lasts, and it goes away."""
    early, text = on_a_terminal(
        'import time; from ssi_ros.cli._options import Progress\n'
        'print("begin", flush=True)\n'
        'with Progress("thinking"): time.sleep(5)')
    assert 'thinking   0%' in early and text.count('thinking') > 2
    assert text.rstrip(' ').endswith('\r')
    _, quick = on_a_terminal('from ssi_ros.cli._options import Progress\n'
                             'with Progress("thinking") as p: p(0.5)')
    assert quick == ''


def test_a_warning_stands_above_a_bar():
    """On a line of its own, from its beginning."""
    _, text = on_a_terminal(
        'import time; from ssi_ros.cli._options import Progress, warn\n'
        'with Progress("thinking"): time.sleep(1); warn(["slow"])')
    assert 'thinking' in text.partition('warning')[0] and '\rwarning: slow\r\n' in text


def test_calibrate_has_a_bar_while_it_reads(bag, tmp_path, monkeypatch):
    """Two bags have half of it each; the fit, which is left out here, has its own."""
    shares = {}

    class Bar:
        def __init__(self, text):
            self.shares = shares.setdefault(text, [])

        def __enter__(self):
            return self.shares.append

        def __exit__(self, *error):
            pass

    def stop(*given, **options):
        raise ValueError('far enough')
    monkeypatch.setattr('ssi_ros.cli._options.Progress', Bar)
    monkeypatch.setattr('ssi_ros.updating.calibrate.calibrate', stop)
    other = tmp_path / 'other'
    shutil.copytree(bag, other)
    assert main(['calibrate', str(bag), str(other), '--output', str(tmp_path / 'm.yaml')]) != 0
    reading = shares['reading']
    assert reading == sorted(reading) and reading[-1] == 1.0 and 0.5 in reading
    assert 'calibrating' in shares


def test_colour_obeys_no_color(bag, capsys):
    """Labels of modes have colour on a terminal, none with NO_COLOR, and none in a pipe."""
    code = ('from ssi_ros.cli.main import main\n'
            f'main(["identify", {str(bag)!r}, "--window-s", "20", "--hop-s", "20"])')
    assert '\033[32mstructural\033[0m' in on_a_terminal(code, NO_COLOR='')[1]
    plain = on_a_terminal(code, NO_COLOR='1')[1]
    assert 'structural' in plain and '\033[3' not in plain
    assert main(['identify', str(bag), '--window-s', '20', '--hop-s', '20']) == 0
    piped = capsys.readouterr().out
    assert 'structural' in piped and '\033' not in piped
