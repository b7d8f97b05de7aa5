"""
Eigenvalues by routines of LAPACK that SciPy's functions do not reach.

LAPACK's dgeev turns an n x n matrix of vectors through every step. Shapes need C phi alone, and
its parts do to l rows what they do to n: that saves a sixth of the time. They, and dstevd, which
scipy.linalg.lapack has from SciPy 1.16 on, come from the table of LAPACK that SciPy keeps for
compiled code (`scipy.linalg.cython_lapack`).
"""
import ctypes

import numpy as np
from scipy.linalg import cython_lapack
from scipy.linalg.lapack import dgebal, dgeev, dgehrd


def _routine(name, arguments):
    """Return a LAPACK routine whose arguments are all addresses."""
    capsule = cython_lapack.__pyx_capi__[name]
    api = ctypes.pythonapi
    api.PyCapsule_GetName.restype = ctypes.c_char_p
    api.PyCapsule_GetPointer.restype = ctypes.c_void_p
    api.PyCapsule_GetName.argtypes = [ctypes.py_object]
    api.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    address = api.PyCapsule_GetPointer(capsule, api.PyCapsule_GetName(capsule))
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arguments)(address)


def _integers(*values):
    """Return integers as LAPACK takes them, and the address of each."""
    held = np.array(values, dtype=np.intc)
    first = held.ctypes.data
    return held, range(first, first + held.nbytes, held.itemsize)


_dormhr, _dlahqr, _dtrevc = _routine('dormhr', 14), _routine('dlahqr', 14), _routine('dtrevc', 14)
_dstevd = _routine('dstevd', 11)


def tridiagonal_eigen(diagonal, beside):
    """
    Return all eigenvalues and eigenvectors of a symmetric tridiagonal matrix, by dstevd.

    Parameters
    ----------
    diagonal, beside : ndarray, shapes (n,) and (n - 1,)
        The diagonal and the one beside it, n >= 2.

    Returns
    -------
    values : ndarray, shape (n,)
        In rising order.
    vectors : ndarray, shape (n, n)
        One a column.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the iteration does not converge.

    """
    n = len(diagonal)
    values, rest, vectors = diagonal.copy(), beside.copy(), np.empty((n, n), order='F')
    work = np.empty(1 + 4 * n + n * n)
    integers = np.empty(3 + 5 * n, dtype=np.intc)
    numbers, (size, room, integer_room, fault) = _integers(n, len(work), len(integers), 0)
    _dstevd(b'V', size, values.ctypes.data, rest.ctypes.data, vectors.ctypes.data, size,
            work.ctypes.data, room, integers.ctypes.data, integer_room, fault)
    if numbers[3]:
        raise np.linalg.LinAlgError('the eigenvalues of the covariances do not converge')
    return values, vectors


def output_eigen(a, c):
    """
    Return the eigenvalues of A and C phi of its eigenvectors.

    Parameters
    ----------
    a : ndarray, shape (n, n)
        In Fortran order; it is overwritten.
    c : ndarray, shape (l, n)
        Output matrix.

    Returns
    -------
    real, imag : ndarray, shape (n,)
        Eigenvalues; of a pair the one with positive imaginary part first.
    output : ndarray, shape (l, n)
        C phi as LAPACK packs vectors: of a pair first the real parts, then the imaginary. The
        scale of a vector is any.

    """
    n, width = len(a), len(c)
    kept = a.copy(order='F')
    a, _, _, balance, _ = dgebal(a, scale=1, permute=0, overwrite_a=1)
    h, tau, _ = dgehrd(a, overwrite_a=1)
    rows = np.array(c * balance, order='F')
    real, imag, vectors = np.empty(n), np.empty(n), np.empty((n, n), order='F')
    work = np.empty(max(3, width, 32) * n)
    numbers, (size, rows_c, one, room, fault) = _integers(n, width, 1, len(work), 0)
    h_at, rows_at, work_at, out = (x.ctypes.data for x in (h, rows, work, vectors))
    _dormhr(b'R', b'N', rows_c, size, one, size, h_at, size, tau.ctypes.data, rows_at, rows_c,
            work_at, room, fault)
    _dlahqr(one, one, size, one, size, h_at, size, real.ctypes.data, imag.ctypes.data, one,
            rows_c, rows_at, rows_c, fault)
    if numbers[4]:                    # not converged: as rare as it is for dgeev
        real, imag, _, vectors, _ = dgeev(kept, compute_vl=0)
        return real, imag, c @ vectors
    _dtrevc(b'R', b'A', one, size, h_at, size, out, size, out, size, size, room, work_at, fault)
    return real, imag, rows @ vectors
