"""What a verb is going to write: checked before the work begins, not after it."""
import os
from pathlib import Path
import shutil

# options that name a file to write, and a folder that is made as needed
FILES = ('json', 'html', 'markdown', 'apply', 'output', 'modes', 'npz')
FOLDERS = ('plot', 'folder')
SUFFIXES = {'html': ('.html', '.htm'), 'markdown': ('.md', '.markdown'), 'json': ('.json',)}


def check_outputs(args):
    """
    Check that every file and every folder that the options name can be written.

    Raises
    ------
    ValueError
        If a folder does not exist, the name is that of a folder, does not end as its format
        does, or is given twice.
    OSError
        If a folder may not be written to.

    """
    written = {}
    for name in FILES:
        value = getattr(args, name, None)
        many = name == 'json' and getattr(args, 'many', None)       # then it names a folder
        if (not value or isinstance(value, bool) or str(value) == '-' or many
                or is_bag(args, name)):
            continue
        path, option = Path(value), f'--{name}'
        if written.setdefault(path.resolve(), option) != option:
            raise ValueError(f'{written[path.resolve()]} and {option} name the same file {path}; '
                             'give two names')
        if path.is_dir():
            raise ValueError(f'{option} {path} is a folder; name a file')
        page = name == 'output' and args.verb == 'report'
        ends = SUFFIXES.get('html' if page else name, (path.suffix.lower(),))
        if path.suffix.lower() not in ends:
            raise ValueError(f'{option} {path} must end in {ends[0]}')
        if not path.parent.is_dir():
            raise ValueError(f'{option} {path}: the folder {path.parent} does not exist; make it '
                             'first')
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise OSError(f'{option} {path} may not be written to')
    for name in FOLDERS:
        if value := getattr(args, name, None):
            path = Path(value)
            there = next(p for p in (path, *path.absolute().parents) if p.exists())
            if not there.is_dir():
                raise ValueError(f'--{name} {path}: {there} is a file; name a folder')
            if not os.access(there, os.W_OK):
                raise OSError(f'--{name} {path}: {there} may not be written to')


def is_bag(args, name):
    """Return whether an option names a bag to write, whose folders are made as needed."""
    return name == 'output' and args.verb in ('import', 'recover', 'record')


def add_overwrite(parser):
    """Declare the option of verbs that write a bag."""
    parser.add_argument('--overwrite', action='store_true',
                        help='remove a bag of that name first')


def check_room(path, overwrite):
    """
    Check, before the work, that a bag may be written; `make_room` removes the old one after it.

    Raises
    ------
    ValueError
        If something is there and `overwrite` is false, or it is no bag.

    """
    path = Path(path)
    if path.exists() and not overwrite:
        raise ValueError(f'{path} exists; give another name, or --overwrite')
    if path.exists() and not (path / 'metadata.yaml').is_file() and not list(path.glob('*.mcap')):
        raise ValueError(f'{path} is no bag, and is not removed; give another name')


def make_room(path):
    """Remove the bag that stands where one is written now, if there is one."""
    if Path(path).exists():
        shutil.rmtree(path)
