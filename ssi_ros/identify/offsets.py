"""Channels of one rate that are sampled at different instants: by how much, and put right."""
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve

from ssi_ros.arrays import marked_or_all, runs

BLOCK = 256             # ticks over which a phase is taken
FEW = 16                # stamps that it needs
MOST = 1 << 18          # stamps that are looked at at once
SMALL = 2e-3            # of a sample: below it an offset is left as it is
LARGE = 0.02            # of a sample: above it an offset may not be left as it is
DRIFTS = 0.25           # samples by which one clock may run away from another within a record
EDGE = 32               # samples lost at either end of an unbroken run that is moved
KEPT = 0.9              # share of a channel's samples that must survive that
SHORT = 4               # missing samples in a row that are bridged while a run is moved
NUGGET = 1e-9           # of the power of a channel, so that its covariances can be solved with


@dataclass(frozen=True)
class Offset:
    """How a channel's instants lie beside those of the first channel, in samples."""

    offset: float = 0.0     # later by so much; of stamps alone -0.5 to 0.5, of rows -1 to 1
    drift: float = 0.0      # and by so much more at the end of the record than at its beginning


def offsets(stamps_ns, rate_hz, start_ns, end_ns):
    """
    Return the Offset of every channel, from the turning of mean phasors block by block.

    Parameters
    ----------
    stamps_ns : sequence of ndarray of int64
        Stamps of each channel [ns].
    rate_hz : float
        Common rate [Hz].
    start_ns, end_ns : int
        Between which stamps are looked at: a strange one may be years away [ns].

    """
    stamps_ns = [s[marked_or_all((s >= start_ns) & (s <= end_ns))] for s in stamps_ns]
    held = [s for s in stamps_ns if len(s)]
    if not held:
        return [Offset() for _ in stamps_ns]
    first = min(int(s.min()) for s in held)
    blocks = int((max(int(s.max()) for s in held) - first) * 1e-9 * rate_hz / BLOCK) + 1
    means = []
    for c, stamps in enumerate(stamps_ns):
        # channels of one message have the same stamps
        same = c and np.array_equal(stamps, stamps_ns[c - 1])
        means.append(means[-1] if same else _phasors(stamps, first, rate_hz, blocks))
    reference = next(m for m, s in zip(means, stamps_ns) if len(s))
    return [_between(m, reference) for m in means]


def _phasors(stamps_ns, first_ns, rate_hz, blocks):
    """Return the mean phasor of every block, NaN of those with few stamps."""
    every, n, real, imaginary = np.arange(blocks), *np.zeros((3, blocks))
    # a day at once would take five times the room of its stamps
    for begin in range(0, len(stamps_ns), MOST):
        ticks = (stamps_ns[begin:begin + MOST] - first_ns) * 1e-9 * rate_hz
        at, turn = (ticks / BLOCK).astype(np.int64), 2.0 * np.pi * np.mod(ticks, 1.0)
        n += np.bincount(at, minlength=blocks)
        # sums so far come first, so that they grow in one order and to the same bits
        at = np.concatenate([every, at])
        real, imaginary = (np.bincount(at, np.concatenate([sums, part]), blocks)
                           for sums, part in ((real, np.cos(turn)), (imaginary, np.sin(turn))))
    return np.where(n < FEW, np.nan, (real + 1j * imaginary) / np.maximum(n, 1.0))


def _between(phasors, reference):
    both = phasors * np.conj(reference)
    number = np.flatnonzero(np.isfinite(both))
    if not len(number):
        return Offset()
    turns = np.unwrap(np.angle(both[number])) / (2.0 * np.pi)
    slope = np.polyfit(number, turns, 1)[0] if len(number) > 2 else 0.0
    middle = float(np.median(turns))
    return Offset(middle - round(middle), float(slope * (number[-1] - number[0])))


def moved(values, offset):
    """
    Return a channel as it was so many samples earlier; the spectrum of its noise stays.

    Every unbroken run is turned in phase, no frequency changes in size, after the line between
    its ends is taken away; EDGE samples at either end of a run are lost. Up to SHORT missing
    samples do not end a run: they are bridged by the most probable values between their
    neighbours, and are missing again afterwards.

    Parameters
    ----------
    values : ndarray, shape (n,)
        NaN where a sample is missing.
    offset : float
        In samples.

    Returns
    -------
    ndarray, shape (n,)

    """
    out, missing = np.full(len(values), np.nan), np.isnan(values)
    whole = bridged(values)
    for begin, end in runs(np.isfinite(whole)):
        if end - begin <= 2 * EDGE:
            continue
        run = whole[begin:end]
        line = np.linspace(run[0], run[-1], len(run))
        turn = np.exp(-2j * np.pi * np.fft.rfftfreq(len(run)) * offset)
        # the line itself moves by its slope
        slope = (run[-1] - run[0]) / (len(run) - 1)
        new = np.fft.irfft(np.fft.rfft(run - line) * turn, len(run)) + line - slope * offset
        out[begin + EDGE:end - EDGE] = new[EDGE:-EDGE]
    out[missing] = np.nan
    return out


def bridged(values):
    """
    Return a channel (n,) whose gaps of up to SHORT samples hold the most probable values.

    They are those of a Gaussian series of its own covariance, given EDGE samples on either side.
    """
    missing = np.isnan(values)
    gaps = [g for g in runs(missing) if g[1] - g[0] <= SHORT]
    if not gaps or missing.all():
        return values
    out, mean = values.copy(), np.nanmean(values)
    size = 1 << int(np.ceil(np.log2(len(values) + 2 * EDGE + SHORT)))
    by_lag = [np.fft.irfft(np.abs(np.fft.rfft(series, size)) ** 2, size)[:2 * EDGE + SHORT]
              for series in (np.where(missing, 0.0, values - mean), (~missing).astype(float))]
    covariance = by_lag[0] / np.maximum(np.rint(by_lag[1]), 1.0)
    covariance[0] *= 1 + NUGGET
    for begin, end in gaps:
        near = np.arange(max(begin - EDGE, 0), min(end + EDGE, len(values)))
        near = near[~missing[near]]
        lost = np.arange(begin, end)
        if len(near):
            known = covariance[np.abs(near[:, None] - near)]
            beside = covariance[np.abs(near[:, None] - lost)]
            try:
                weights = solve(known, beside, assume_a='sym')
            except np.linalg.LinAlgError:       # a channel that stands still, or repeats itself
                weights = np.linalg.lstsq(known, beside)[0]
            out[begin:end] = mean + (values[near] - mean) @ weights
    return out


def together(values, found, names, rate_hz):
    """
    Return rows with all channels at the instants of the first, and a sentence where any was moved.

    Where none is late the rows are those that were given, not a copy.

    Parameters
    ----------
    values : ndarray, shape (n, l)
        NaN where a sample is missing.
    found : list of Offset
        Of every channel.
    names : sequence of str
        Of the channels.
    rate_hz : float
        Common rate [Hz].

    Raises
    ------
    ValueError
        If a clock runs away from that of the first channel, or so many samples are missing that
        an offset cannot be made good.

    """
    by = late_by(found, names)
    if not any(by):     # a copy of a day is large
        return values, ''
    values, said = values.copy(), []
    for c, late in enumerate(by):
        if not late:
            continue
        new = moved(values[:, c], late)
        if np.isfinite(new).sum() < KEPT * np.isfinite(values[:, c]).sum():
            if abs(late) < LARGE:
                continue
            raise ValueError(f'{names[c]} is sampled {1e3 * late / rate_hz:+.3g} ms beside '
                             f'{names[0]}, and too many samples are missing to move it there; '
                             'sample both at the same instants')
        values[:, c] = new
        said.append(_late(names[c], late, rate_hz))
    return values, (f'sampled beside {names[0]}: {", ".join(said)}; moved to its instants' if said
                    else '')


def late_by(found, names):
    """
    Return by how many samples each channel is sampled later than the first, 0 where hardly.

    Raises
    ------
    ValueError
        If a clock runs away from that of the first channel.

    """
    for name, o in zip(names, found):
        if abs(o.drift) > DRIFTS:
            raise ValueError(f'the clock of {name} runs away from that of {names[0]} by '
                             f'{abs(o.drift):.3g} samples within the record; stamp both by one '
                             'clock, or cut the record into shorter ones')
    return tuple(o.offset if abs(o.offset) >= SMALL else 0.0 for o in found)


def compared_there(late, names, rate_hz):
    """Return a sentence on channels that are compared as they were sampled, or none."""
    said = [_late(n, o, rate_hz) for n, o in zip(names, late) if o]
    return f'sampled beside {names[0]}: {", ".join(said)}; compared there' if said else ''


def _late(name, late, rate_hz):
    """Return a channel and by how much it is late [ms], in words."""
    return f'{name} {1e3 * late / rate_hz:+.3g} ms'


def words(found, names, rate_hz):
    """Return a sentence for every channel whose shapes an offset turns, a list."""
    out = []
    for name, o in zip(names, found):
        ms = 1e3 * o.offset / rate_hz
        if abs(o.drift) > DRIFTS:
            out.append(f'the clock of {name} runs away from that of {names[0]} by '
                       f'{abs(o.drift):.3g} samples within the record: shapes turn with it')
        elif abs(o.offset) > LARGE:
            out.append(f'{name} is sampled {ms:+.3g} ms beside {names[0]}: its component of a '
                       f'shape at f Hz is turned by {0.36 * ms:+.3g} f degrees')
    return out
