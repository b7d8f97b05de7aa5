# Licensed under the Apache License, Version 2.0.
"""
Run a tool on one bag: a command, never an import; a fresh process in a fresh folder.

The tool sees a copy of the bag, named `bag`, in an empty folder that is also its home and its
temporary folder: no other bag, no name, nothing that an earlier run left.
"""
from contextlib import contextmanager
import fcntl
import os
from pathlib import Path
import shlex
import shutil
import signal
import subprocess
import tempfile
import time

from blindgen.seal import write_json

TOOL = '.venv/bin/ssi_ros diagnose {bag} --model config/spacecraft.yaml --json {json}'
LOOK_S = 0.02               # how often a running tool is looked at


def answer(folder, name, tool, timeout_s):
    """
    Run the tool on one bag unless its answer is there; return its name and any failure.

    The answer is put in its place whole, by renaming; what it took goes to `runs/`. A lock, which
    the system takes off a killed process, keeps two campaigns from doing one bag twice.
    """
    folder = Path(folder)
    done, told = folder / 'answers' / f'{name}.json', folder / 'runs' / f'{name}.json'
    for path in (done, told):
        path.parent.mkdir(exist_ok=True)
    with _locked(told.with_suffix('.lock')) as mine:
        if done.exists():
            return name, ''
        if not mine:
            return name, 'another campaign is at it'
        with tempfile.TemporaryDirectory(prefix='blind.') as alone:
            bag, out = Path(alone) / 'bag', Path(alone) / 'answer.json'
            _copy(folder / 'bags' / name, bag, name)
            run = run_alone([word.format(bag=bag, json=out) for word in shlex.split(tool)],
                            Path(alone), timeout_s)
            if not run['trouble'] and not out.exists():
                run['trouble'] = f'exit {run["exit"]}, no answer: {run["last_words"]}'
            write_json(told, run)
            if out.exists() and not run['trouble']:
                part = done.with_suffix('.part')
                shutil.copyfile(out, part)
                part.replace(done)
    return name, run['trouble']


def run_alone(command, home, timeout_s):
    """
    Return what a command took: seconds, peak memory, exit code, its last words and any trouble.

    Raises
    ------
    ValueError
        If the command is not found.

    """
    environment = {**os.environ, 'HOME': str(home), 'TMPDIR': str(home),
                   'XDG_CACHE_HOME': str(home), 'ROS_LOG_DIR': str(home)}
    # Dask's, for its workers: a tool would spend most of its time in page faults
    environment.pop('MALLOC_TRIM_THRESHOLD_', None)
    begin, trouble = time.monotonic(), ''
    with open(home / 'words.txt', 'w+') as words:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=words,
                                       stderr=subprocess.STDOUT, env=environment,
                                       start_new_session=True)
        except FileNotFoundError:
            raise ValueError(f'command {command[0]!r} is not found; give its path in '
                             '--tool') from None
        while True:
            # wait4 alone tells the peak memory of this one child
            gone, status, usage = os.wait4(process.pid, os.WNOHANG)
            if gone:
                break
            if time.monotonic() - begin > timeout_s and not trouble:
                trouble = f'no answer in {timeout_s:.0f} s'
                os.killpg(process.pid, signal.SIGKILL)
            time.sleep(LOOK_S)
        process.returncode = os.waitstatus_to_exitcode(status)
        words.seek(0)
        last = words.read().strip()[-300:]
    return {'seconds': time.monotonic() - begin, 'cpu_s': usage.ru_utime + usage.ru_stime,
            'peak_mb': usage.ru_maxrss / 1024, 'exit': process.returncode, 'last_words': last,
            'trouble': trouble}


def _copy(bag, to, name):
    """Copy a bag under a name that all bags have; its metadata name the file of the samples."""
    to.mkdir()
    for path in bag.iterdir():
        copy = to / path.name.replace(name, 'bag')
        if path.suffix == '.yaml':
            copy.write_text(path.read_text().replace(name, 'bag'))
        else:
            shutil.copyfile(path, copy)


@contextmanager
def _locked(path):
    """Yield whether the lock is ours; a lock of a process that was killed is free."""
    with open(path, 'w') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield True
        except BlockingIOError:
            yield False
