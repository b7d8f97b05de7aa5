"""The verb that says what a record could tell."""
from ssi_ros.cli.main import main


def test_table(capsys):
    """Every spectral effect has a line with its detection."""
    assert main(['identifiability', '--duration-s', '60']) == 0
    text = capsys.readouterr().out
    assert 'sensor_gain:channel=e2_b' in text and 'clock_rate:' in text


def test_too_short(capsys):
    """A second is not enough, and the message says what is."""
    assert main(['identifiability', '--duration-s', '1']) == 2
    assert 's are needed' in capsys.readouterr().err
