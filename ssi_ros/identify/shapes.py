"""Measures of mode shapes."""
import numpy as np


def mac(a, b):
    """
    Return the modal assurance criterion of every shape in `a` with every one in `b`.

    Parameters
    ----------
    a, b : ndarray, shape (p, l) and (q, l), complex
        One shape a row.

    Returns
    -------
    ndarray, shape (p, q)
        |a^H b|^2 / (a^H a)(b^H b), 0 to 1.

    """
    cross = np.abs(a.conj() @ b.T) ** 2
    return cross / np.outer((np.abs(a) ** 2).sum(axis=1), (np.abs(b) ** 2).sum(axis=1))


def collinearity(shapes):
    """
    Return the modal phase collinearity of every shape, 1 where it is real up to a phase.

    Parameters
    ----------
    shapes : ndarray, shape (p, l), complex
        One shape a row.

    Returns
    -------
    ndarray, shape (p,)
        |s^T s|^2 / (s^H s)^2; 1 for a single channel.

    """
    return (np.abs((shapes ** 2).sum(axis=1)) / (np.abs(shapes) ** 2).sum(axis=1)) ** 2


def upright(shape):
    """
    Turn a shape so that its components lie along the real axis as well as they can.

    Parameters
    ----------
    shape : ndarray, shape (l,), complex
        Largest component 1.

    Returns
    -------
    ndarray, shape (l,), complex
        The phase that maximises the sum of squares of the real parts; the largest is positive.

    """
    turned = shape * np.exp(-0.5j * np.angle((shape ** 2).sum()))
    return turned * (-1.0 if turned[np.argmax(np.abs(turned))].real < 0.0 else 1.0)
