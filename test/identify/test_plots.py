"""The plots show what was identified, and write without modes too."""
from dataclasses import replace

import numpy as np
import pytest
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import Identification, identify
from ssi_ros.identify.plot_stability import accepted
from ssi_ros.identify.plot_tracks import POINTS_MAX, thinned, tracks
from ssi_ros.identify.plots import FIGURES, spectrum_of, write_plots
from ssi_ros.records import Samples, WindowModes

NAMES = tuple('abcd')


@pytest.fixture(scope='module')
def windows():
    """Return three windows of a minute with their samples."""
    values = accelerations(PAIR_HZ, PAIR_SHAPES, 80.0, np.random.default_rng(3))
    samples = Samples(values, 100.0, NAMES)
    return samples, identify(samples, Identification(window_s=60.0, hop_s=10.0))


def test_every_mode_has_its_poles(windows):
    """A mode is drawn with at least three accepted poles within 1 % of it."""
    last = windows[1][-1]
    poles = np.array([p.frequency_hz for p in accepted(last)])
    assert last.modes
    for mode in last.modes:
        assert (abs(poles / mode.frequency_hz - 1.0) < 0.01).sum() >= 3


def test_files_and_their_content(windows, tmp_path):
    """Every figure twice."""
    samples, found = windows
    paths = write_plots(found, tmp_path, NAMES, spectrum_of(
        found[-1], [samples.stamps_ns()] * 4, list(samples.values.T), 100.0))
    assert {p.name for p in paths} == {f'{n}.{end}' for n in FIGURES for end in ('png', 'svg')}
    assert all(p.stat().st_size > 5000 for p in paths)


def test_spectrum_peaks_at_the_modes(windows):
    """The highest line of the spectrum lies within two of its bins of a mode."""
    samples, found = windows
    frequency, level = spectrum_of(found[-1], [samples.stamps_ns()] * 4,
                                   list(samples.values.T), 100.0)
    assert abs(PAIR_HZ - frequency[level.argmax()]).min() < 2.0 * frequency[0]


def test_windows_without_modes_are_drawn(tmp_path):
    """Without a mode there are pictures as well; no window at all is refused."""
    assert write_plots([WindowModes(0, 10 ** 9, (), 'nothing moves')], tmp_path, NAMES)
    with pytest.raises(ValueError, match='no windows'):
        write_plots([], tmp_path, NAMES)


def test_a_day_of_windows_stays_small(windows, tmp_path):
    """Ten thousand windows are thinned: few points and few artists, the last one is kept."""
    pattern = windows[1]
    day = [replace(pattern[k % 3], start_ns=k * 10 ** 9, end_ns=(k + 60) * 10 ** 9)
           for k in range(10000)]
    kept = thinned(day)
    assert POINTS_MAX // 2 < len(kept) <= POINTS_MAX and kept[-1] is day[-1]
    figure = tracks(kept, 'damping')
    # two bands, and one line of markers a label: an artist a point would take minutes to draw
    assert all(len(ax.lines) <= 3 and len(ax.collections) <= 2 for ax in figure.axes)


def test_a_short_life_is_drawn(windows):
    """An identity seen once has an error bar, one missed in between an open band."""
    a, b, c = windows[1]
    figure = tracks([a, replace(b, modes=()), c], 'frequency')
    band = figure.axes[0].collections[0].get_paths()
    assert len(band) == 2 and 'Hz' in figure.axes[0].get_title()
    single = tracks([a], 'frequency')
    assert len(single.axes) == len(a.modes)
