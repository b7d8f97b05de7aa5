"""A headless Chromium for tests, where the machine has one, driven by its DevTools protocol."""
from contextlib import contextmanager
import itertools
import json
import os
import shutil
import subprocess
import time
from urllib.request import urlopen

# without a graphics card, and on a busy machine, drawing in space can take a minute
PATIENCE_S = 240.0
NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable',
         'chrome-headless-shell')
FLAGS = ('--headless', '--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader',
         '--force-prefers-reduced-motion', '--host-resolver-rules=MAP * ~NOTFOUND',
         '--window-size=1200,1000', '--remote-debugging-port=0', 'about:blank')


def find():
    """Return the browser's path: that of CHROMIUM in the environment, or the first installed."""
    return os.environ.get('CHROMIUM') or next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def browser(folder):
    """Run a browser without a network; its profile goes to the folder."""
    from websockets.sync.client import connect
    process = subprocess.Popen([find(), f'--user-data-dir={folder}', *FLAGS],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        port = wait(lambda: (folder / 'DevToolsActivePort').is_file() and (
            folder / 'DevToolsActivePort').read_text().split())[0]
        pages = wait(lambda: [p for p in json.load(urlopen(f'http://127.0.0.1:{port}/json'))
                              if p['type'] == 'page'])
        with connect(pages[0]['webSocketDebuggerUrl'], max_size=None) as socket:
            yield Page(socket)
    finally:
        process.terminate()
        process.wait(timeout=20)


class Page:
    """The one page of the browser."""

    def __init__(self, socket):
        self.socket, self.numbers = socket, itertools.count(1)

    def ask(self, method, **params):
        """Send one command and return its result."""
        number = next(self.numbers)
        self.socket.send(json.dumps({'id': number, 'method': method, 'params': params}))
        while (answer := json.loads(self.socket.recv(timeout=PATIENCE_S))).get('id') != number:
            pass
        assert 'error' not in answer, answer
        return answer['result']

    def open(self, address):                # noqa: A003, the word for it
        """Go to an address; the page before is left first, so that scripts run anew."""
        self.ask('Page.navigate', url='about:blank')
        self.ask('Page.navigate', url=address)

    def value(self, expression):
        """Return the value of an expression in the page."""
        return self.ask('Runtime.evaluate', expression=expression,
                        returnByValue=True)['result'].get('value')

    def until(self, expression, patience_s=PATIENCE_S):
        """Wait until an expression has a value that is true, and return it."""
        return wait(lambda: self.value(expression), patience_s)


def wait(ask, patience_s=PATIENCE_S):
    """Return the first answer that is true."""
    end = time.monotonic() + patience_s
    while not (answer := ask()):
        assert time.monotonic() < end, f'waited {patience_s} s in vain'
        time.sleep(0.02)
    return answer
