"""The samples that a diagnosis is made of, out of a bag."""


def read_samples(path, rate_hz, channels=None, scale=1.0, *, staggered=False,
                 progress=lambda share: None):
    """
    Read the accelerometers of a bag, or other channels, onto one even grid; missing is NaN.

    A rate of 0 is estimated from the stamps; `scale` is the factor to m/s^2. Channels that are
    sampled one beside the other are moved to common instants, or stay as they are if `staggered`.
    `progress` is called with the share that is read.

    Raises
    ------
    ValueError
        Without samples, or if two publishers are mixed, or if the clock jumps: the longest part
        cannot stand for all of it.

    """
    from dataclasses import replace

    from ssi_ros.bag import open_bag, read_channels
    from ssi_ros.cli._mixed import check_publishers
    from ssi_ros.cli._modes import scaled
    from ssi_ros.cli._options import warn
    from ssi_ros.quantity import shown
    from ssi_ros.report.samples import samples_of

    try:
        bag = open_bag(path)
        warn(bag.warnings)
        recording = read_channels(bag, channels, progress)
        check_publishers(bag, recording)
        samples = samples_of(scaled(recording, scale), rate_hz,
                             lambda text: warn([text]), staggered=staggered)
    except ValueError as error:
        raise ValueError(named(path, error)) from error
    # a name out of a file must not end a line of what is printed of it
    return replace(samples, channels=tuple(shown(n.rsplit('/', 1)[-1]) for n in samples.channels))


def named(path, error):
    """Return what an error says, with the bag's name before it where it is not there yet."""
    return str(error) if str(error).startswith(f'{path}') else f'{path}: {error}'
