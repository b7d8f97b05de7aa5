"""
Measure what is there to look at, and make the pictures of the README.

Pages: size, time to make, time to open in a headless Chromium (CHROMIUM names one). Monitor: its
share of a core beside a live simulator and identifier at 4 x 100 Hz. `python -m validation.see`
writes docs/validation/see.md and docs/figures.
"""
import asyncio
import base64
import fcntl
import importlib
import os
from pathlib import Path
import pty
import re
import statistics
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time

from ssi_ros.effects import inject, load_configuration, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.monitor.screen import Screen
from ssi_ros.monitor.watch import Status, Watch, with_health, with_window
from ssi_ros.report.bag_page import bag_page, Judged, windows_of
from ssi_ros.report.diagnosis_page import diagnosis_page, view_of
from ssi_ros.report.identification_page import identification_page
from ssi_ros.ros.demo import Processes
from ssi_ros.updating.calibrate import calibrate

from .report import ROOT, table, write

sys.path.insert(0, str(ROOT / 'test' / 'report'))
browser = importlib.import_module('browser')            # the tests' own
FIGURES = ROOT / 'docs' / 'figures'
SEED, EFFECT, DURATION_S = 5, 'array_asymmetry:array=E1,scale=1.02', 600.0
PICTURES = {'report_shape': 'shapes3d', 'report_maps': 'map_sensor_before',
            'report_stabilisation': 'stabilisation', 'report_closed': 'closed'}
# without the buttons of Plotly, and a mode that twists
DRESS = ('document.head.insertAdjacentHTML("beforeend", '
         '"<style>.modebar {display: none}</style>");'
         '(s => { if (s) { s.selectedIndex = 5; s.dispatchEvent(new Event("change")); } })'
         '(document.querySelector("select"))')
SETTLE_S, WATCH_S = 30.0, 60.0
TRIED = '## Tried by hand'


def pages():
    """Return the pages by name, the seconds that each step took, and the windows."""
    spacecraft, _ = load_configuration(str(ROOT / 'config' / 'spacecraft.yaml'))
    samples = simulate_setup(inject(spacecraft, (parse_effect(EFFECT),), DURATION_S), SEED)
    healthy = simulate_setup(inject(spacecraft, (), DURATION_S), SEED + 1)
    took, begin = {}, time.perf_counter()

    def done(step):
        nonlocal begin
        took[step] = time.perf_counter() - begin
        begin = time.perf_counter()
    spacecraft = calibrate(spacecraft, [healthy]).spacecraft
    done('calibrate')
    found = diagnose(spacecraft, samples)
    done('diagnose')
    view = view_of(found, spacecraft, samples)
    done('curves of the page')
    windows = windows_of(samples)
    done('identify 20 windows')
    model = 'config/spacecraft.yaml'
    made = {'report BAG --model F': bag_page(
        'real', samples, windows, judged=Judged(spacecraft, found, view, model))}
    done('write the report')
    made['diagnose --html F'] = diagnosis_page(found, view, bag='real',
                                               nominal=f'--model {model}')
    done('write the diagnosis')
    return made, took, windows


def open_times(path, folder):
    """Return times to open [ms], five plain and two with every picture; take the pictures."""
    plain, every = [], []
    opened = 'document.documentElement.dataset.openedMs'
    with browser.browser(folder) as page:
        for times, hash_ in ((plain, ''),) * 5 + ((every, '#all'),) * 2:
            page.open(f'file://{path}{hash_}')
            times.append(int(page.until(opened)))
        page.value(DRESS)
        for name, place in PICTURES.items():
            if not page.value(f'!!document.getElementById("{place}")'):
                continue
            page.value(f'document.getElementById("{place}").scrollIntoView()')
            time.sleep(2.0)
            box = page.value(f'(b => ({{x: b.x, y: b.y + scrollY, width: b.width, height: '
                             f'b.height}}))(document.getElementById("{place}")'
                             '.getBoundingClientRect())')
            shot = page.ask('Page.captureScreenshot', clip=box | {'scale': 1},
                            captureBeyondViewport=True)
            (FIGURES / f'{name}.png').write_bytes(base64.b64decode(shot['data']))
    return plain, every


def identify_pictures(windows, folder):
    """Photograph the page of `identify --plot` on a desktop and on a telephone."""
    page_path = folder / 'identify.html'
    page_path.write_text(identification_page('real', windows, (
        'e1_a', 'e1_b', 'e2_a', 'e2_b')), encoding='utf-8')
    with browser.browser(folder / 'profile_identify') as page:
        for name, width, height in (('now', 1400, 1500), ('telephone', 390, 1500)):
            page.ask('Emulation.setDeviceMetricsOverride', width=width, height=height,
                     deviceScaleFactor=1, mobile=width < 600)
            page.open(f'file://{page_path}#all')
            page.until('document.documentElement.dataset.openedMs')
            time.sleep(2.0)
            shot = page.ask('Page.captureScreenshot', clip={
                'x': 0, 'y': 0, 'width': width, 'height': height, 'scale': 1},
                captureBeyondViewport=True)
            (FIGURES / f'identify_page_{name}.png').write_bytes(base64.b64decode(shot['data']))


def screen_picture(windows):
    """Draw the monitor's screen as it stands after these windows."""
    watch, now = Watch(), time.monotonic()
    for w in windows:
        watch = with_window(watch, w, now)
    watch = with_health(watch, [
        Status(f'identifier: channel {c}', 'ok', '100.00 Hz') for c in (
            'e1_a', 'e1_b', 'e2_a', 'e2_b')] + [
        Status('identifier: identification', 'ok', f'{len(windows[-1].modes)} modes')], now)

    async def run():
        app = Screen(lambda: watch)
        async with app.run_test(size=(150, 42)) as pilot:
            await pilot.pause(0.3)
            # without its fonts, which would come from the network
            (FIGURES / 'monitor.svg').write_text(re.sub(
                r'@font-face \{.*?\}', '', app.export_screenshot(), flags=re.S))
    asyncio.run(run())


def monitor_share(folder):
    """Return the monitor's share of a core, and the bytes a second that it writes."""
    nodes = Processes(folder / 'log')
    nodes.start('identifier', 'identifier', window_s=20.0, hop_s=1.0)
    nodes.start('simulator', 'simulator', seed=SEED)
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack('HHHH', 45, 150, 0, 0))
    monitor = subprocess.Popen([sys.executable, '-m', 'ssi_ros', 'monitor'], stdin=its, stdout=its,
                               stderr=its, env=nodes.environment | {'TERM': 'xterm-256color'})
    written = []

    def read():
        while True:
            try:
                written.append(len(os.read(ours, 65536)))
            except OSError:
                return
    threading.Thread(target=read, daemon=True).start()

    def spent_s():
        words = Path(f'/proc/{monitor.pid}/stat').read_text().rsplit(')', 1)[1].split()
        return (int(words[11]) + int(words[12])) / os.sysconf('SC_CLK_TCK')
    try:
        time.sleep(SETTLE_S)
        before, sent, began = spent_s(), sum(written), time.monotonic()
        time.sleep(WATCH_S)
        nodes.check()
        wall = time.monotonic() - began
        return (spent_s() - before) / wall, (sum(written) - sent) / wall
    finally:
        monitor.terminate()
        monitor.wait(timeout=10)
        nodes.kill()


def by_hand():
    """Return the lines of the page that a person wrote after trying."""
    text = (ROOT / 'docs' / 'validation' / 'see.md').read_text()
    return (TRIED + text.partition(TRIED)[2].rstrip()).split('\n')


def main():
    """Measure, draw, write."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        made, took, windows = pages()
        rows = []
        for k, (name, text) in enumerate(made.items()):
            path = folder / f'{k}.html'
            path.write_text(text, encoding='utf-8')
            plain, every = open_times(path, folder / f'profile{k}')
            rows.append((f'`{name}`', f'{len(text.encode()) / 1e6:.2f}', min(plain),
                         f'{statistics.median(plain):.0f}', min(every)))
        screen_picture(windows)
        identify_pictures(windows, folder)
        share, rate = monitor_share(folder)
    lines = [f'Record: {DURATION_S:g} s at 4 x 100 Hz with `{EFFECT}`. Other work ran on the '
             f'machine (load {os.getloadavg()[0]:.1f}).', '', '## Pages', '',
             'Time from the start of the navigation until the page can be used, five times, in a '
             'headless Chromium without a graphics card or a network; "all" with every picture '
             'drawn (`#all`), the others draw when they come into view. Targets: 5 MB, 2000 ms.',
             '', *table(('page', 'MB', 'least ms', 'median ms', 'all: least of two ms'), rows),
             *table(('step', 'seconds'), [(k, f'{v:.1f}') for k, v in took.items()]),
             '## Monitor', '',
             f'{100 * share:.1f} % of a core over {WATCH_S:g} s (target 5 %), beside a simulator '
             'at 4 x 100 Hz and an identifier with a result a second, in a terminal of 150 x 45; '
             f'{rate / 1e3:.0f} kB/s to the terminal.', '',
             '## The page of `identify --plot`', '',
             'On a desktop of 1400 pixels, up to 14b3cb0 and now; on a telephone of 390, up to '
             '6da4e93 and now.', '',
             *(f'![{name}](../figures/{name}.png)' for name in (
                 'identify_page_before', 'identify_page_now', 'identify_telephone_before',
                 'identify_page_telephone')), '', *by_hand()]
    write('see', 'Pages and screens', lines, SEED)


if __name__ == '__main__':
    main()
