"""Bags in which another recorder has mixed two publishers: named, and no modes of the mixture."""
import numpy as np
import pytest
from scipy.signal import lfilter
from ssi_ros.bag import BagWriter, encode_accel
from ssi_ros.bag.interleaved import doubtful_words, mixed_words
from ssi_ros.bag.layout import SENSOR
from ssi_ros.cli.main import main

PERIOD_NS = 10_000_000
COUNT = 6000
STAMPS = 10 ** 18 + np.arange(COUNT, dtype=np.int64) * PERIOD_NS


def vibration(seed, angles=(0.2, 0.9), damping=0.999):
    """Return a record of modes at so many radians a sample."""
    noise = np.random.default_rng(seed).standard_normal((len(angles), COUNT))
    return sum(lfilter([1.0], [1.0, -2 * damping * np.cos(a), damping ** 2], n)
               for a, n in zip(angles, noise))


def both(beside_ns, part=slice(None)):
    """Return stamps and values of two publishers, in the order of their stamps."""
    stamps = np.concatenate([STAMPS, STAMPS[part] + beside_ns])
    values = np.concatenate([vibration(1), vibration(2)[part]])
    order = np.argsort(stamps, kind='stable')
    return stamps[order], values[order]


@pytest.fixture(scope='module')
def bag_of(tmp_path_factory):
    """Return a function that writes a bag of one topic, as a recorder that notes nothing."""
    def write(stamps, values, publishers=1):
        path = tmp_path_factory.mktemp('mixed') / 'bag'
        with BagWriter(path) as bag:
            bag.add_topic('/a', 'geometry_msgs/msg/AccelStamped', [SENSOR] * publishers)
            for stamp, raw in zip(stamps.tolist(), encode_accel(stamps, values, 'a')):
                bag.write('/a', bytes(raw), stamp, stamp)
        return path
    return write


@pytest.mark.parametrize('beside_ns, words', (
    (0, '6000 of 12000 samples of /a have the stamp of another one'),
    (3_000_000, 'by turns 3 and 7 ms apart'), (200_000, 'by turns 0.2 and 9.8 ms apart')))
def test_stamps_that_two_publishers_make_are_refused(bag_of, capsys, beside_ns, words):
    """Equal stamps, and steps that alternate: by identify, diagnose and report, named by info."""
    bag = bag_of(*both(beside_ns))
    for verb in ('identify', 'diagnose', 'report'):
        assert main([verb, str(bag)]) == 2
        said = capsys.readouterr().err
        assert words in said and 'two publishers sent on one topic' in said, said
    assert main(['info', str(bag)]) == 0
    assert ('with the stamp of another one' if beside_ns == 0 else 'as of two publishers'
            ) in capsys.readouterr().out


def test_where_they_were_mixed_is_said():
    """The second publisher was there for 10 s of 60."""
    stamps, values = both(3_000_000, slice(2000, 3000))
    # blocks of 128 stamps, 0.6 s, are judged together
    assert 'from 19.' in mixed_words('a', stamps, values) or 'from 20.' in mixed_words(
        'a', stamps, values)
    stamps, values = both(0, slice(2000, 3000))
    assert 'from 20.0 to 30.0 s' in mixed_words('a', stamps, values)


@pytest.mark.parametrize('publishers', (1, 2))
def test_publishers_half_a_period_apart(bag_of, capsys, publishers):
    """Stamps are even then: a warning by the values, refused where the bag has two publishers."""
    bag = bag_of(*both(PERIOD_NS // 2), publishers)
    code = main(['identify', str(bag), '--window-s', '20', '--hop-s', '10'])
    said = capsys.readouterr().err
    assert 'every second sample of /a tells nothing of the one before' in said
    assert (code == 2 and 'has found 2 publishers' in said) == (publishers == 2)
    assert main(['info', str(bag)]) == 0
    assert ('2 publishers when it was joined' in capsys.readouterr().out) == (publishers == 2)


@pytest.mark.parametrize('stamps', (
    STAMPS, np.repeat(STAMPS[::2], 2), STAMPS // 4_000_000 * 4_000_000,
    STAMPS + np.random.default_rng(3).integers(-4_000_000, 4_000_000, COUNT),
    np.sort(np.random.default_rng(4).choice(STAMPS, COUNT // 2, replace=False))),
    ids=('even', 'twice', 'rounded', 'jitter', 'lost'))
def test_one_publisher_is_not_two(stamps):
    """Stamps that are even, rounded, uneven or lost; messages that were written twice."""
    values = vibration(1)[:len(stamps)]
    if len(np.unique(stamps)) == COUNT // 2 and len(stamps) == COUNT:
        values = np.repeat(values[::2], 2)
    assert mixed_words('a', stamps, values) == ''


@pytest.mark.parametrize('values', (
    vibration(1), vibration(1, (np.pi / 2,)), vibration(1, (0.02,)), np.zeros(COUNT),
    np.random.default_rng(5).standard_normal(COUNT), np.sin(0.3 * np.arange(COUNT)),
    np.where(np.arange(COUNT) % 50, vibration(1), np.nan), np.full(COUNT, 1e200)),
    ids=('modes', 'a quarter of the rate', 'slow', 'zero', 'noise', 'line', 'lost', 'wild'))
def test_one_record_is_not_doubtful(values):
    """Among them what comes near: a mode at a quarter of the rate, and white noise."""
    assert doubtful_words('a', STAMPS, values) == ''
