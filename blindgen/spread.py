# Licensed under the Apache License, Version 2.0.
"""Spread work over processes with Dask: a cluster of this machine, or any by its address."""
from contextlib import contextmanager

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
    whole or not at all.
    """
    if client is None:
        for job in tqdm(jobs, desc=text):
            yield function(*job)
        return
    from distributed import as_completed
    futures = [client.submit(function, *job, pure=False) for job in jobs]
    for future in tqdm(as_completed(futures), total=len(futures), desc=text):
        yield future.result()
        future.release()
