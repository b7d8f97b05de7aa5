"""
List the library of effects: what each does, its parameters with units and ranges, its source.

An effect is injected with `ssi_ros simulate BAG --effect NAME:PARAM=VALUE,...`. Another package
adds effects by an entry point in the group `ssi_ros.effects`.
"""
HELP = 'list the effects that a simulator may lack'
EXAMPLE = 'ssi_ros effects sensor_gain'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('names', nargs='*', metavar='NAME', help='only these (default: all)')
    parser.add_argument('--markdown', action='store_true', help='print docs/effects.md')


def run(args):
    """Print the library."""
    from ssi_ros.effects import effect_class, library

    chosen = [effect_class(n) for n in args.names] or list(library().values())
    if args.markdown:
        print(markdown(chosen))
        return 0
    for cls in chosen:
        print(f'{cls.name} ({cls.site.value}): {summary(cls)}')
        for name, null, span, unit, doc in parameters(cls):
            print(f'    {name:<20}{doc}; null {null}{span}{unit}')
        print(f'    source: {cls.reference}')
    print(f'{len(chosen)} effect' + 's' * (len(chosen) != 1))
    return 0


def summary(cls):
    """Return the first paragraph of a class's docstring on one line."""
    import inspect
    return ' '.join(inspect.getdoc(cls).split('\n\n')[0].split())


def parameters(cls):
    """Yield name, default, range, unit and meaning of every quantity, as text."""
    from ssi_ros.quantity import quantities
    for f in quantities(cls):
        meta = f.metadata
        words = isinstance(f.default, str)
        span = '' if words else f', {meta["low"]:g} to {meta["high"]:g}'
        unit = '' if words or meta['unit'] == '1' else f' [{meta["unit"]}]'
        default = f.default if words else f'{f.default:g}'
        yield f.name, default, span, unit, meta['doc']


def markdown(classes):
    """Return the library as the text of docs/effects.md."""
    lines = ['# Library of effects', '',
             'Made by `ssi_ros effects --markdown > docs/effects.md`; each entry is what the file',
             '`ssi_ros/effects/<name>.py` declares. Equations are those of `theory-gap.md`.',
             'Every number is at its null by default, and the size of an effect at its null',
             'changes nothing.']
    site = None
    for cls in classes:
        if cls.site is not site:
            site = cls.site
            lines += ['', f'## {site.value.capitalize()}']
        lines += ['', f'### {cls.name}', '', summary(cls), '',
                  '| parameter | default | range | unit | meaning |', '|---|---|---|---|---|']
        for name, null, span, unit, doc in parameters(cls):
            size = ' (size)' if name == cls.size else ''
            lines.append(f'| `{name}`{size} | {null} | {span[2:]} | {unit.strip(" []")} | {doc} |')
        lines += ['', f'Source: {cls.reference}.']
    return '\n'.join(lines)
