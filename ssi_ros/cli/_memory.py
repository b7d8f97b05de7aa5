"""Memory of a process that makes and frees large arrays thousands of times."""
import ctypes
import math

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3     # glibc's malloc.h
KEPT = 1 << 28          # bytes that are not handed back
SHARE = 0.8             # of the free memory that one command may take
LARGEST = 32 << 20      # glibc takes no larger threshold for an array with pages of its own


def keep_freed_memory():
    """
    Let the C library keep freed arrays for the next ones; does nothing where it is not glibc.

    Dask gives its workers, and all that they start, a threshold of 64 kB above which freed memory
    goes back to the system: then two thirds of a diagnosis are page faults.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return
    mallopt(M_TRIM_THRESHOLD, KEPT)
    mallopt(M_MMAP_THRESHOLD, LARGEST)


def check_memory(needed, what):
    """
    Check, before the work, that there is memory for it.

    Parameters
    ----------
    needed : float
        Estimate [byte].
    what : str
        What needs it, for the sentence.

    Raises
    ------
    ValueError
        If it is more than four fifths of what is free on this machine.

    """
    free = available()
    if needed > SHARE * free:
        raise ValueError(f'{what} needs about {needed / 1e9:.3g} GB of memory, and '
                         f'{free / 1e9:.3g} GB are free; ask for less')


def available():
    """Return the memory that a command may take, file caches included [byte]; inf if unknown."""
    try:
        with open('/proc/meminfo', encoding='ascii') as lines:
            return 1024 * next(int(line.split()[1]) for line in lines
                               if line.startswith('MemAvailable:'))
    except (OSError, StopIteration, ValueError):
        return math.inf
