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
    return responses_and_noise(inputs, outputs, steps, count)[0]


def responses_and_noise(inputs, outputs, steps, count, ridge=0.0):
    """
    Return pulse responses, and the standard error of one of their samples.

    Parameters
    ----------
    inputs, outputs, steps, count
        As `pulse_responses` takes them.
    ridge : float, optional
        White noise that the past is taken to have, of its rms. Behind a low-pass filter the past
        holds nothing near the highest frequency; an observer that is free there runs away.

    Returns
    -------
    responses : ndarray, shape (K, l, r)
    noise : float
        Residual of the observer over the root of the number of samples, in units of the outputs
        over those of the inputs: as if the inputs were white and of unit variance.

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
    if ridge:
        lift = ridge * np.sqrt((table ** 2).sum(axis=0))
        fit = np.linalg.solve(table.T @ table + np.diag(lift ** 2), table.T @ outputs[steps:])
    else:
        fit = np.linalg.lstsq(table, outputs[steps:], rcond=None)[0]
    left = outputs[steps:] - table @ fit
    noise = np.sqrt((left ** 2).mean() / max(1, len(table) - unknown))
    fit = fit.T
    observer = fit[:, r:].reshape(width, steps, r + width)
    # h_0 is the feedthrough; h_k = B_k + sum over i of A_i h_(k-i), nothing beyond p steps
    out = [fit[:, :r]]
    for k in range(1, count + 1):
        h = observer[:, k - 1, :r].copy() if k <= steps else np.zeros((width, r))
        for i in range(1, min(k, steps) + 1):
            h += observer[:, i - 1, r:] @ out[k - i]
        out.append(h)
    return np.array(out[1:]), float(noise)
