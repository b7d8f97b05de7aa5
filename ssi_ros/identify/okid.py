"""
OKID: pulse responses from a recorded input, by way of an observer.

Juang, Phan, Horta and Longman, Journal of Guidance, Control, and Dynamics 16 (1993) 320-329. With
an observer of p steps the response to all of the past fits into p samples, also where damping is
low; the responses of the structure follow by recursion and go to `era`.
"""
import numpy as np


def pulse_responses(inputs, outputs, steps, count):
    """
    Return the pulse responses of a structure whose input was recorded.

    Parameters
    ----------
    inputs, outputs : ndarray, shape (n, r) and (n, l)
        What was recorded, without missing samples.
    steps : int
        Steps p of the observer; p l should exceed the order of the structure.
    count : int
        Number K of samples wanted after the pulse.

    Returns
    -------
    ndarray, shape (K, l, r)
        From one sample after the pulse on, ready for `era`. The direct feedthrough is not in it.

    Raises
    ------
    ValueError
        Where the records do not fit each other, or are too short for the steps.

    """
    inputs, outputs = np.asarray(inputs, dtype=float), np.asarray(outputs, dtype=float)
    if inputs.ndim != 2 or outputs.ndim != 2 or len(inputs) != len(outputs):
        raise ValueError(f'inputs of shape {inputs.shape} and outputs of shape {outputs.shape} '
                         'given; (n, r) and (n, l) of the same n are needed')
    if not (np.isfinite(inputs).all() and np.isfinite(outputs).all()):
        raise ValueError('a sample is missing; OKID needs all of them')
    (n, r), width = inputs.shape, outputs.shape[1]
    unknown = r + steps * (r + width)
    if steps < 1 or n - steps < unknown:
        raise ValueError(f'{n} samples given; steps={steps} needs 1 or more steps and '
                         f'{unknown + steps} samples or more')
    both = np.concatenate([inputs, outputs], axis=1)
    past = np.lib.stride_tricks.sliding_window_view(both[:-1], steps, axis=0)[:, :, ::-1]
    table = np.concatenate([inputs[steps:], past.transpose(0, 2, 1).reshape(n - steps, -1)],
                           axis=1)
    fit = np.linalg.lstsq(table, outputs[steps:], rcond=None)[0].T
    observer = fit[:, r:].reshape(width, steps, r + width)
    # h_0 is the feedthrough; h_k = B_k + sum over i of A_i h_(k-i), nothing beyond p steps
    out = [fit[:, :r]]
    for k in range(1, count + 1):
        h = observer[:, k - 1, :r].copy() if k <= steps else np.zeros((width, r))
        for i in range(1, min(k, steps) + 1):
            h += observer[:, i - 1, r:] @ out[k - i]
        out.append(h)
    return np.array(out[1:])
