# Licensed under the Apache License, Version 2.0.
"""
Run a tool on one case: commands, never an import; fresh processes in a fresh folder.

The tool sees a copy of the case in an empty folder that is also its home and its temporary folder:
`bag`, `healthy_1` to at most 3, `model.yaml`. No other case, no name, nothing that an earlier run
kept.
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

from blindgen.arithmetic import without
from blindgen.proof.seal import read_json, write_json

# one command a line; {healthy} is all healthy recordings, each a word
TOOL = ('.venv/bin/ssi_ros calibrate {healthy} --model {model} --output {calibrated}',
        '.venv/bin/ssi_ros diagnose {bag} --model {calibrated} --json {json}')
POLL_S = 0.02               # how often a running tool is polled
LAST_WORDS = 2000           # characters of what a tool printed last that are kept
SHARE = 0.05            # of the time since its begin, after which a tool is looked at again


def answer(folder, name, tool, timeout_s):
    """
    Run the tool on one case unless its answer is there; return its name and any failure.

    The answer is put in its place whole, by renaming; what it took goes to `runs/`. A lock, which
    the system takes off a killed process, keeps two campaigns from doing one case twice.
    """
    folder = Path(folder)
    done, data = folder / 'answers' / f'{name}.json', folder / 'runs' / f'{name}.json'
    for path in (done, data):
        path.parent.mkdir(exist_ok=True)
    with _locked(data.with_suffix('.lock')) as mine:
        if done.exists():
            return name, ''
        if not mine:
            return name, 'another campaign has it in work'
        with tempfile.TemporaryDirectory(prefix='blind.') as alone:
            run, out = _answered(folder / 'cases' / name, Path(alone), tool, timeout_s)
            if data.exists():
                before = read_json(data)
                run['earlier'] = [*before.get('earlier', ()), before['trouble']]
            write_json(data, run)
            if out.exists() and not run['trouble']:
                part = done.with_suffix('.part')
                shutil.copyfile(out, part)
                part.replace(done)
    return name, run['trouble']


def _answered(case, alone, tool, timeout_s):
    """
    Return what all commands took, and the answer's path.

    A command that ends with an exit code is no reason to stop: by its code a tool may say what it
    found. One that could not do its work leaves nothing to go on with, and the next says so.
    """
    for path in sorted(case.iterdir()):
        if path.is_dir():
            _copy(path, alone / path.name)
        else:
            shutil.copyfile(path, alone / path.name)
    out, total = alone / 'answer.json', {}
    healthy = [str(p) for p in sorted(alone.glob('healthy_*'))]
    places = {'bag': alone / 'bag', 'json': out, 'model': alone / 'model.yaml',
              'calibrated': alone / 'calibrated.yaml'}
    for command in tool:
        words = [w for word in shlex.split(command) for w in (
            healthy if word == '{healthy}' else [word.format(healthy=healthy[0], **places)])]
        run = run_alone(words, alone, timeout_s - total.get('seconds', 0.0))
        said = [total.get('last_words', ''), run['last_words']]
        total = {**run, **{k: run[k] + total.get(k, 0.0) for k in ('seconds', 'cpu_s')},
                 'peak_mb': max(run['peak_mb'], total.get('peak_mb', 0.0)),
                 'each_cpu_s': [*total.get('each_cpu_s', ()), run['cpu_s']],
                 'exits': [*total.get('exits', ()), run['exit']],
                 'last_words': '\n'.join(filter(None, said))}
        if run['trouble']:
            break
    if not total['trouble'] and not out.exists():
        total['trouble'] = (f'exit {", ".join(map(str, total["exits"]))}, no answer: '
                            f'{total["last_words"][-LAST_WORDS:]}')
    return total, out


def run_alone(command, home, timeout_s):
    """
    Return what a command took: seconds, peak memory, exit code, its last words and any trouble.

    Raises
    ------
    ValueError
        If the command is not found.

    """
    environment = {**without(os.environ), 'HOME': str(home), 'TMPDIR': str(home),
                   'XDG_CACHE_HOME': str(home), 'ROS_LOG_DIR': str(home)}
    # Dask's, for its workers: a tool would spend most of its time in page faults
    environment.pop('MALLOC_TRIM_THRESHOLD_', None)
    begin, trouble, peak_mb = time.monotonic(), '', 0.0
    with open(home / 'words.txt', 'w+') as words:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=words,
                                       stderr=subprocess.STDOUT, env=environment,
                                       start_new_session=True)
        except FileNotFoundError:
            raise ValueError(f'command {command[0]!r} is not found; give its path in '
                             '--tool') from None
        while True:
            peak_mb = max(peak_mb, _peak_mb(process.pid))
            gone, status, usage = os.wait4(process.pid, os.WNOHANG)
            if gone:
                break
            if time.monotonic() - begin > timeout_s and not trouble:
                trouble = f'no answer in {timeout_s:.1f} s'
                os.killpg(process.pid, signal.SIGKILL)
            # a tool may end soon after it began: a first look at it would be all there is
            time.sleep(min(POLL_S, 0.001 + SHARE * (time.monotonic() - begin)))
        process.returncode = os.waitstatus_to_exitcode(status)
        words.seek(0)
        last = words.read().strip()[-LAST_WORDS:]
    return {'seconds': time.monotonic() - begin, 'cpu_s': usage.ru_utime + usage.ru_stime,
            'peak_mb': peak_mb or usage.ru_maxrss / 1024, 'exit': process.returncode,
            'last_words': last, 'trouble': trouble}


def _peak_mb(pid):
    """
    Return the peak memory of a running process [MB], 0 where it has ended.

    What wait4 says begins with the memory of the process that started it, however large that was.
    """
    try:
        with open(f'/proc/{pid}/status') as status:
            lines = [line.split() for line in status]
    except OSError:
        return 0.0
    return next((float(line[1]) / 1024 for line in lines if line[0] == 'VmHWM:'), 0.0)


def _copy(bag, to):
    """Copy a bag; its file of samples and its metadata have the folder's name already."""
    to.mkdir()
    for path in bag.iterdir():
        shutil.copyfile(path, to / path.name)


@contextmanager
def _locked(path):
    """Yield whether the lock is ours; a lock of a process that was killed is free."""
    with open(path, 'w') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield True
        except BlockingIOError:
            yield False
