"""Show what is in a bag: topics, types, counts, rates, gaps, duration, size."""
HELP = 'show what is in a bag'
EXAMPLE = 'ssi_ros info night_1 --json'


def add_arguments(parser):
    """Declare the options."""
    parser.add_argument('bag', metavar='BAG', help='folder of the bag, or its .mcap or .db3')
    parser.add_argument('--json', action='store_true', help='print JSON')


def run(args):
    """Print the summary; 1 for a bag without messages."""
    import json

    from ssi_ros.bag import open_bag
    from ssi_ros.bag.summary import as_text, summarise
    from ssi_ros.cli._options import Progress, warn

    with Progress('reading') as progress:
        summary = summarise(open_bag(args.bag), progress)
    warn(summary['warnings'])
    print(json.dumps(summary, indent=1) if args.json else as_text(summary))
    return 0 if summary['messages'] else 1
