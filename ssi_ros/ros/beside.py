"""Words for channels that are sampled beside the first one, and for clocks that run apart."""


def beside_words(name, first, offset_s, together):
    """
    Return the words for a channel whose stamps lie beside those of the first one.

    Parameters
    ----------
    name, first : str
        Of the channel and of the first one.
    offset_s : float
        By how much it is sampled later [s].
    together : bool
        Whether it is moved.

    Returns
    -------
    str

    """
    ms = 1e3 * offset_s
    return (f'{name} is sampled {ms:+.3g} ms beside {first}: ' + (
        'moved to its instants; a gap costs it 32 samples more on either side' if together else
        f'its component of a shape at f Hz is turned by {0.36 * ms:+.3g} f degrees'))


def apart_words(names, first):
    """Return why nothing can be said of channels whose clocks run away, empty for none."""
    return (f'the clock of {", ".join(sorted(names))} runs away from that of {first}: no '
            'diagnosis; stamp all channels by one clock') if names else ''
