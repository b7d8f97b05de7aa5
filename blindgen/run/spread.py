# Licensed under the Apache License, Version 2.0.
"""Spread work over processes with Dask: a cluster of this machine, or any by its address."""
from contextlib import contextmanager
from pathlib import Path
import traceback

import numpy as np
from tqdm import tqdm


@contextmanager
def cluster(workers=1, scheduler='local'):
    """
    Yield a Dask client; None, for work in this process, when `workers` is 0.

    Parameters
    ----------
    workers : int
        Processes of a local cluster, one thread each.
    scheduler : str
        'local', or the address of a Dask scheduler as tcp://HOST:PORT. Its workers import
        `blindgen` and see the same folder.

    Raises
    ------
    ValueError
        If nobody answers at the address.

    """
    if scheduler == 'local' and workers == 0:
        yield None
        return
    import logging

    import dask
    from distributed import Client, LocalCluster
    # A worker that grows must finish its case, not be paused: a case is small and then gone.
    dask.config.set({'distributed.worker.memory.pause': False,
                     'distributed.worker.memory.terminate': False})
    if scheduler == 'local':
        with LocalCluster(n_workers=workers, threads_per_worker=1, memory_limit=None,
                          dashboard_address='127.0.0.1:0', silence_logs=logging.ERROR) as own:
            with Client(own) as client:
                yield client
        return
    try:
        client = Client(scheduler, timeout='20s')
    except (OSError, ValueError) as error:
        raise ValueError(f'scheduler={scheduler!r}: {error}; start it with `dask scheduler`, or '
                         "leave --scheduler out for this machine's cores") from None
    with client:
        yield client


def spread(client, function, jobs, text):
    """
    Yield function(*job) of all jobs as they are done, with a progress bar and its ETA.

    A job that a lost worker had is done again by another; so what a job writes must be written
    whole or not at all. A job that fails stops no other: all are done, then the failure is raised.

    Raises
    ------
    ValueError
        At once if a job finds a user's mistake, which all jobs share.
    RuntimeError
        At the end if jobs failed, with how many and why the first one did.

    """
    work, failed = tqdm(_outcomes(client, function, jobs), total=len(jobs), desc=text), []
    for result, failure in work:
        if failure:
            failed.append(failure)
        else:
            yield result
    if failed:
        raise RuntimeError(f'{text}: {len(failed)} of {len(jobs)} failed, the first by '
                           f'{failed[0]}\nWhat is done is kept: mend the cause and give the '
                           'same command again.')


def _outcomes(client, function, jobs):
    if client is None:
        yield from (_tried(function, job) for job in jobs)
        return
    from concurrent.futures import CancelledError

    from distributed import as_completed, KilledWorker
    for future in as_completed([client.submit(_tried, function, job, pure=False)
                                for job in jobs]):
        try:
            yield future.result()
        except (KilledWorker, CancelledError) as error:      # it took worker after worker along
            yield None, f'{type(error).__name__}: {error}'
        future.release()


def _tried(function, job):
    """Return what a job returns and '', or None and where and why it failed."""
    try:
        return function(*job), ''
    except Exception as error:       # whatever it is, the other cases do not depend on it
        if isinstance(error, ValueError) and not isinstance(error, np.linalg.LinAlgError):
            raise
        at = traceback.extract_tb(error.__traceback__)[-1]
        return None, f'{type(error).__name__} in {Path(at.filename).name}:{at.lineno}: {error}'
