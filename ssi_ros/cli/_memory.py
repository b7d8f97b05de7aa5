"""Memory of a process that makes and frees large arrays thousands of times."""
import ctypes

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3     # glibc's malloc.h
KEPT = 1 << 30          # bytes that are not handed back
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
