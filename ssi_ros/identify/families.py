"""
The harmonics of a line that is no sine: a machine that knocks, a thruster that pulses.

A jump of the force between two samples folds harmonics of every order into the band. Poles fit
them in groups, with a damping that no line has. Section 7 of docs/theory-identification.md.
"""
from ssi_ros.identify.harmonics import LINE_DAMPING, SHARP

STRONG = 10.0 * SHARP   # sharpness from which a line is looked at as the first of a family
NEAR = 6.0              # bins of 1 / T from n times the line in which a pole is its harmonic
DAMPED = 2.0 * LINE_DAMPING     # a pole of more damping that is not seen to be sharper only
HIT = 1.5               # belongs to it if it is so many bins from it
MEMBERS = 3             # lines, the first among them, that make a family


def judge_families(judged, held_s, nyquist_hz):
    """
    Look at the poles of a window once more where a line has harmonics.

    Parameters
    ----------
    judged : list of (Candidate, float, str, str)
        Every candidate with its sharpness, label and note.
    held_s : float
        Length of the window [s].
    nyquist_hz : float
        Half of the rate of the stream [Hz].

    Returns
    -------
    list of (str, str)
        Label and note of every candidate.

    """
    words = [(label, note) for _, _, label, note in judged]
    firsts = sorted((c.frequency_hz for c, sharp, _, _ in judged
                     if c.damping_ratio < LINE_DAMPING and sharp > STRONG))
    for first in firsts:
        # one pole may stand for a line and those that are folded in beside it, with some damping
        lines = [c.damping_ratio < DAMPED or label == 'input_line' for c, _, label, _ in judged]
        orders = [_order(c.frequency_hz, first, held_s, nyquist_hz, NEAR if line else HIT)
                  for (c, _, _, _), line in zip(judged, lines)]
        higher = [c for (c, _, _, _), n, line in zip(judged, orders, lines) if n > 1 and line]
        if len(higher) < MEMBERS - 1:
            continue
        for k, (c, _, _, _) in enumerate(judged):
            if orders[k] > 1 and words[k][0] == 'structural':
                words[k] = ('undecided', f'harmonic {orders[k]} of the line at {first:.4g} Hz')
            weakest = min((h.share for h in higher if h.band == c.band), default=0.0)
            if c.share < weakest and words[k][0] == 'structural':
                words[k] = ('undecided', 'weaker than every harmonic of the line at '
                            f'{first:.4g} Hz; higher ones are folded in')
        break           # the lowest line that has harmonics explains those of its harmonics
    return words


def _order(hz, first_hz, held_s, nyquist_hz, reach):
    """Return the n for which a frequency is n times a line and below Nyquist, 0 if none."""
    n = round(hz / first_hz)
    off = abs(hz - n * first_hz) * held_s
    return n if n >= 1 and n * first_hz < nyquist_hz and off < reach else 0
