"""Bags in which two publishers of one topic are mixed: refused, or said."""


def check_publishers(bag, recording):
    """
    Check that each channel of a bag holds the samples of one publisher.

    Parameters
    ----------
    bag : Bag
        With the publishers that its recorder has found.
    recording : Recording
        Channels of it.

    Raises
    ------
    ValueError
        If stamps or values show that two are mixed. What the values alone make probable is a
        warning.

    """
    from ssi_ros.bag.interleaved import doubtful_words, mixed_words
    from ssi_ros.cli._options import warn
    doubts = []
    for channel, stamps, values in zip(recording.channels, recording.stamps_ns, recording.values):
        if words := mixed_words(channel.topic, stamps, values):
            raise ValueError(words)
        if doubt := doubtful_words(channel.topic, stamps, values):
            found = len(bag.topic(channel.topic).qos)
            if found > 1:
                raise ValueError(f'{doubt}; its recorder has found {found} publishers: record it '
                                 'again from one')
            doubts.append(doubt)
    warn(doubts[:1])        # of one cause, as a rule
