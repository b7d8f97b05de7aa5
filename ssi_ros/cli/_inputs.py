"""Recorded inputs of a model, out of a bag or of a simulator."""

HELP = ('a recorded input of the model, such as a commanded torque: what it makes of the channels '
        'is predicted; repeatable. TOPIC[:FIELD] may be followed by =NAME, the input of the model '
        '(default: the one that the topic is named after, or the only one that has a level); '
        'a value is held until the next')


def add_input(parser):
    """Declare the option."""
    parser.add_argument('--input', action='append', metavar='TOPIC[:FIELD]', help=HELP)


def read_inputs(path, given, model, samples):
    """
    Read recorded inputs of a model in the rows of a record.

    Parameters
    ----------
    path : Path
        The bag.
    given : sequence of str or None
        As the option has them.
    model : Spacecraft or LinearModel
        Whose inputs they are.
    samples : Samples
        The record.

    Returns
    -------
    Samples or None
        None where none is given.

    Raises
    ------
    ValueError
        If a topic, a field or an input does not exist, or the input does not fit the record.

    """
    import numpy as np

    from ssi_ros.bag import open_bag, read_channels
    from ssi_ros.inputs.rows import in_rows
    from ssi_ros.records import Samples

    if not given:
        return None
    bag, channels = open_bag(path), []
    for text in given:
        words, _, name = text.partition('=')
        channels.append(_channel(bag, words, name or None, model))
    names = [c.name for c in channels]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f'two topics are given for the input {name} of the model; write '
                             '--input TOPIC:FIELD=NAME for each')
    recording, columns = read_channels(bag, channels), []
    for channel, stamps, values in zip(channels, recording.stamps_ns, recording.values):
        try:
            columns.append(in_rows(stamps, values, samples))
        except ValueError as error:
            raise ValueError(f'--input {channel.topic}:{channel.field} {error}') from None
    return Samples(np.column_stack(columns), samples.rate_hz, names, samples.start_ns)


def inputs_of_each(paths, given, model, recordings):
    """Return the recorded inputs of every recording; an empty tuple where none is given."""
    if not given:
        return ()
    found = []
    for path, samples in zip(paths, recordings):
        try:
            found.append(read_inputs(path, given, model, samples))
        except ValueError as error:
            raise ValueError(f'{path}: {error}') from None
    return tuple(found)


def _channel(bag, words, name, model):
    """Return the Channel of an option, named after the input of the model."""
    from ssi_ros.bag import Channel
    from ssi_ros.bag.schema import numeric_fields

    topic, _, field = words.partition(':')
    if not topic.startswith('/') or words.endswith(':'):
        raise ValueError(f'--input {words!r} must be /topic or /topic:field, such as '
                         '/torque:wrench.torque.x')
    there = bag.topic(topic)
    if not field:
        fields = [f for f in numeric_fields(there.type, there.definition or '')
                  if '.stamp.' not in f] if there.definition else []
        if len(fields) != 1 and fields[:1] != ['data']:
            raise ValueError(f'--input {topic} needs a field: {there.type} has '
                             + (', '.join(fields[:8]) or 'no numeric ones')
                             + f'; write {topic}:FIELD')
        field = fields[0]
    return Channel(topic, '', field, input_of(model, name, topic, field))


def input_of(model, name, topic, field):
    """Return the input of a model that a topic is recorded of."""
    from ssi_ros.inputs.beside import driven_inputs, inputs_of

    names, driven = inputs_of(model), driven_inputs(model)
    if name is not None:
        if name not in names:
            raise ValueError(f'the model has no input {name!r}; it has {", ".join(names)}')
        return name
    leaf = topic.rsplit('/', 1)[-1]
    if leaf in names:
        return leaf
    if len(driven) == 1 or len(names) == 1:
        return (driven or names)[0]
    raise ValueError(f'--input {topic}:{field} may be any of the inputs {", ".join(names)}; '
                     f'write {topic}:{field}=NAME')


def simulated_inputs(setup, excitation, samples, seed):
    """
    Return what drives a simulated record at the inputs of its model, row by row.

    Parameters
    ----------
    setup : Setup
        That was simulated.
    excitation : tuple
        Parts of the model's own; a disturbance that an effect adds is not recorded.
    samples : Samples
        The record.
    seed : int
        Of the record.

    Returns
    -------
    Samples

    """
    from ssi_ros.inputs.beside import driven_inputs
    from ssi_ros.inputs.prediction import rows_before
    from ssi_ros.model.excitation import begin_all
    from ssi_ros.records import Samples

    names, inputs = driven_inputs(setup.spacecraft), setup.system.inputs
    before = rows_before(setup)
    if not names:
        raise ValueError('--record-input: no input of the model has a level; there is nothing to '
                         'record')
    forces = begin_all(excitation, setup.system.rate_hz, inputs, seed)(
        0, before + len(samples.values))[before:]
    return Samples(forces[:, [inputs.index(n) for n in names]], samples.rate_hz, names,
                   samples.start_ns)
