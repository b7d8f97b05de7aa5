"""What a node says of the samples that it waits for and watches."""
from ssi_ros.ros.messages import clock_words


def waits_for(intake):
    """Return the words for channels whose samples have not come yet."""
    return f'waiting for {len(intake.sources)} channels: ' + ', '.join(
        s.resolved for s in intake.sources)


def watches(intake, rows, window_s):
    """Return the words for channels whose samples have come, and when a window will be full."""
    n = len(intake.sources)
    first = rows.origin_ns + round((rows.first / rows.rate_hz + window_s) * 1e9)
    return (f'watching {n} channel{"s" * (n > 1)} at {rows.rate_hz:g} Hz, window {window_s:g} s, '
            f'first result at {clock_words(first)}')
