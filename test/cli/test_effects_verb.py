"""The verb that lists the library, and the option that injects from it."""
from pathlib import Path

from ssi_ros.bag import read_channels
from ssi_ros.cli.effects import markdown
from ssi_ros.cli.main import main
from ssi_ros.effects import library

ROOT = Path(__file__).resolve().parents[2]


def test_lists_all(capsys):
    """Every effect is printed with its parameters."""
    assert main(['effects']) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in library())


def test_near_names(capsys):
    """A wrong name is answered with the near ones."""
    assert main(['effects', 'sensor_gian']) == 2
    assert 'sensor_gain' in capsys.readouterr().err


def test_the_page_is_up_to_date():
    """The page docs/effects.md is what the declarations say."""
    assert (ROOT / 'docs' / 'effects.md').read_text().strip() == markdown(
        list(library().values())).strip()


def test_simulate_with_effects(tmp_path, capsys):
    """Two effects go into a bag; losses become missing messages."""
    bag = tmp_path / 'bag'
    assert main(['simulate', str(bag), '--duration-s', '20', '--effect',
                 'sensor_gain:channel=e1_a,scale=3', '--effect',
                 'dropped_samples:fraction=0.2']) == 0
    plain = tmp_path / 'plain'
    assert main(['simulate', str(plain), '--duration-s', '20']) == 0
    lossy, whole = (read_channels(b) for b in (bag, plain))
    names = [c.rsplit('/', 1)[-1] for c in whole.names]
    i = names.index('e1_a')
    assert 1400 < len(lossy.values[i]) < 1800      # 2000 x 0.8 within 11 sd
    assert lossy.values[i].std() > 2.5 * whole.values[i].std()


def test_simulate_refuses(tmp_path, capsys):
    """An unknown effect makes no bag."""
    assert main(['simulate', str(tmp_path / 'b'), '--effect', 'array_assymetry:scale=0.9']) == 2
    assert 'array_asymmetry' in capsys.readouterr().err
    assert not (tmp_path / 'b').exists()
