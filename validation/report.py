"""What every validation script shares: the head of a report, and where it goes."""
from datetime import date
import os
from pathlib import Path
import platform
import subprocess

ROOT = Path(__file__).resolve().parent.parent


def machine():
    """Return what the numbers were made on, in a few words."""
    cpu = platform.machine()
    for line in Path('/proc/cpuinfo').read_text().splitlines():
        if line.startswith('model name'):
            cpu = line.split(':', 1)[1].strip()
            break
    return f'Python {platform.python_version()}, {os.cpu_count()} cores {cpu}'


def write(topic, title, lines, seed=None, command=None):
    """Write docs/validation/<topic>.md with commit, command, seed and machine, and print it."""
    commit = subprocess.run(['git', 'rev-parse', '--short', 'HEAD'], cwd=ROOT, text=True,
                            capture_output=True).stdout.strip()
    words = f'python -m validation.{command or topic}'
    head = [f'# {title}', '', f'{date.today()}, commit {commit}, `{words}`'
            + ('' if seed is None else f', seed {seed}')
            + f', {machine()}.', '']
    text = '\n'.join([*head, *lines, ''])
    (ROOT / 'docs' / 'validation' / f'{topic}.md').write_text(text)
    print(text)


def table(head, rows):
    """Return the lines of a Markdown table."""
    return ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head),
            *('| ' + ' | '.join(map(str, row)) + ' |' for row in rows), '']


def figure(name):
    """Return a matplotlib figure and the function that saves it under docs/figures."""
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    shape = plt.figure(figsize=(7, 4.2), layout='constrained')

    def save():
        shape.savefig(ROOT / 'docs' / 'figures' / name, dpi=90)
        plt.close(shape)
    return shape, save
