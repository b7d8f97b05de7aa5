"""
Diagnose a folder of bags on a Dask cluster: one JSON a bag, a table of all at the end.

A worker writes the JSON of a bag as its last act and in one step, so after a kill -9 the same
command goes on with the bags that have none: nothing is lost, and nothing is done twice.
"""
import csv
from dataclasses import asdict, dataclass
from functools import lru_cache
import json
import logging
import os
from pathlib import Path

from ssi_ros.cli._memory import keep_freed_memory
from ssi_ros.quantity import probability_text, shown
from ssi_ros.whole_file import whole_file, write_whole

ANSWERS = 'diagnoses'           # folder of the answers, beside the bags
COLUMNS = ('bag', 'outcome', 'effect', 'probability', 'reason')
FAILED = 'ERROR'                # in place of an outcome; such a bag is tried again next time


@dataclass(frozen=True)
class Job:
    """What is the same for all bags; plain data, so that two runs can be compared."""

    model: str = ''
    reference: str = ''
    settings: str = ''
    effects: tuple = ()
    pairs: bool = True
    channels: tuple = ()
    inputs: tuple = ()
    scale: float = 1.0


def run_many(args):
    """Diagnose every bag below a folder; return 0, or 1 if one of them could not be read."""
    from ssi_ros.cli._options import Progress

    folder = args.many
    for value, word in ((args.html, '--html'), (args.markdown, '--markdown'),
                        (args.apply, '--apply')):
        if value is not None:
            raise ValueError(f'{word} belongs to a single bag; leave it out with --many')
    answers = args.json or folder / ANSWERS
    bags = find_bags(folder, answers)
    job = job_of(args)
    _prepare(job)                   # a mistake in model, settings or names ends it before the work
    answers.mkdir(parents=True, exist_ok=True)
    _same_run(answers / 'run.json', job)
    rows = {name: row for name in bags if (row := _read(name, answers)) is not None}
    waiting = [name for name in bags if name not in rows]
    print(f'{len(bags)} bags in {folder}, {len(rows)} of them diagnosed before')
    if waiting:
        with Progress('diagnosing') as progress:
            for row in _diagnose_all(job, {n: bags[n] for n in waiting}, answers, args.workers,
                                     args.scheduler):
                rows[row['bag']] = row
                progress.say(line_of(row))
                progress(len(rows) / len(bags))
    rows = [rows[name] for name in bags]
    write_csv(answers / 'diagnoses.csv', rows)
    print(table(rows))
    print(f'answers and diagnoses.csv are in {answers}')
    return 1 if any(r['outcome'] == FAILED for r in rows) else 0


def find_bags(folder, answers):
    """Return folders below that hold a bag, links followed, by their relative names, in order."""
    if not folder.is_dir():
        raise ValueError(f'{folder} is not a folder; give the one that holds the bags')
    found, seen = {}, set()
    for here, below, files in os.walk(folder, followlinks=True):
        bag, real = Path(here), os.path.realpath(here)
        if real in seen or answers in (bag, *bag.parents):
            below.clear()           # a link that leads back up would be followed for ever
            continue
        seen.add(real)
        below.sort()
        if bag != folder and any(f == 'metadata.yaml' or f.endswith(('.mcap', '.db3'))
                                 for f in files):
            found[bag.relative_to(folder).as_posix()] = bag
    if not found:
        raise ValueError(f'{folder} holds no bags; a bag is a folder in it with metadata.yaml or '
                         '.mcap files')
    return dict(sorted(found.items()))


def job_of(args):
    """Return the Job of the options."""
    if args.model and args.reference:
        raise ValueError('give --model or --reference, not both')
    if args.input and args.reference:
        raise ValueError('--input is predicted by a model; give --model in place of --reference')
    names = tuple(n.strip() for n in args.effects.split(',')) if args.effects else ()
    # a worker elsewhere has another working folder
    model, reference, settings = (str(Path(p).resolve()) if p else ''
                                  for p in (args.model, args.reference, args.settings))
    return Job(model, reference, settings, names, not args.no_pairs, tuple(args.channel or ()),
               tuple(args.input or ()), args.scale)


def diagnose_one(job, name, bag, answers):
    """Diagnose one bag, write its JSON in one step, and return its row; runs on a worker."""
    from threadpoolctl import threadpool_limits
    keep_freed_memory()
    try:
        with threadpool_limits(limits=1):
            found = _diagnosis(job, bag).to_json()
    except (ValueError, OSError) as error:
        found = {'outcome': FAILED, 'reason': str(error)}
    except Exception as error:          # one bag that fails must not end all the others
        found = {'outcome': FAILED, 'reason': f'{type(error).__name__}: {error}'}
    path = _answer(name, answers)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps({'bag': name} | found, indent=1) + '\n')
    return row_of(name, found)


def _diagnosis(job, bag):
    from ssi_ros.cli._samples import read_samples
    from ssi_ros.gap.driver import diagnose
    nominal, present, settings = _prepare(job)
    options = {'effects': list(job.effects) or None, 'pairs': job.pairs}
    if job.reference:
        from ssi_ros.bag import parse_channel
        from ssi_ros.gap.nominal.recorded import RecordedNominal
        channels = [parse_channel(c) for c in job.channels] or None
        return diagnose(RecordedNominal(nominal), read_samples(bag, 0.0, channels, job.scale),
                        settings, **options)
    from ssi_ros.cli._inputs import read_inputs
    from ssi_ros.gap.nominal.model import ModelNominal
    samples = read_samples(bag, nominal.rate_hz, None, job.scale, staggered=not job.inputs)
    inputs = read_inputs(bag, job.inputs, nominal, samples)
    return diagnose(ModelNominal(nominal, present, inputs), samples, settings, **options)


@lru_cache(maxsize=2)
def _prepare(job):
    """Return nominal (a model or the reference's samples), its effects, and settings."""
    from ssi_ros.bag import parse_channel
    from ssi_ros.cli._samples import read_samples
    from ssi_ros.effects import effect_class, load_configuration
    from ssi_ros.gap.settings import load_settings
    settings = load_settings(job.settings or None)
    if job.reference:
        channels = [parse_channel(c) for c in job.channels] or None
        return read_samples(Path(job.reference), 0.0, channels, job.scale), (), settings
    if job.channels:
        raise ValueError('--channel belongs to --reference; a model names its own channels')
    for name in job.effects:
        effect_class(name)
    return (*load_configuration(job.model or None), settings)


def _diagnose_all(job, bags, answers, workers, scheduler):
    """Yield the row of each bag as it comes, from a cluster of one's own or a given one."""
    from dask.distributed import as_completed, Client
    if workers is not None and workers < 1:
        raise ValueError(f'workers={workers} must be 1 or more')
    cluster = None
    if scheduler is None:
        cluster = own_cluster(min(workers or os.cpu_count(), len(bags)))
    with Client(cluster or scheduler, timeout='20s') as client:
        try:
            waiting = {client.submit(diagnose_one, job, name, bag.resolve(), answers.resolve(),
                                     pure=False): name for name, bag in bags.items()}
            for future in as_completed(list(waiting)):
                # let go of: a worker that ends with answers that somebody holds is a warning
                name = waiting.pop(future)
                if future.status == 'error':        # its worker died again and again
                    yield row_of(name, {'outcome': FAILED, 'reason': str(future.exception())})
                else:
                    yield future.result()
        finally:
            if cluster is not None:
                cluster.close()


def own_cluster(workers):
    """
    Return a cluster of processes on this machine, on its loopback, for this command alone.

    Whoever may submit work to Dask runs code as the user of the command, so its connections are
    TLS with a certificate that both sides must have and that only these processes know. Dask
    serves pages beside its dashboard too, on 8787 and on a port a worker: they get no routes.

    Raises
    ------
    ValueError
        If the package that makes certificates is not there.

    """
    import dask
    from dask.distributed import LocalCluster, Security
    try:
        own = Security.temporary()
    except ImportError:
        raise ValueError('--many needs a certificate of its own, so that no other user of this '
                         'machine can send it work: pip install cryptography') from None
    dask.config.set({f'distributed.{who}.http.routes': [] for who in ('scheduler', 'worker')})
    # its profiler and its clock stop a worker a hundred times a second and more, for pages that
    # are not served and for tasks of milliseconds
    dask.config.set({'distributed.worker.profile.enabled': False,
                     'distributed.admin.tick.interval': '1s'})
    # one thread each: the templates of a model are kept by the process that made them. What goes
    # wrong with a bag is in its answer; a worker that ends while it reports is nothing.
    return LocalCluster(n_workers=workers, threads_per_worker=1, protocol='tls://',
                        host='127.0.0.1', dashboard_address=None, security=own,
                        silence_logs=logging.CRITICAL)


def _answer(name, answers):
    return answers / f'{name}.json'


def _same_run(path, job):
    """Check that answers which are there are those of the same job; note the job."""
    mine, usual = (json.loads(json.dumps(asdict(j))) for j in (job, Job()))
    if path.exists():
        before = json.loads(path.read_text())
        other = [k for k in mine if mine[k] != before.get(k, usual[k])]
        if other:
            raise ValueError(
                f'{path.parent} holds the answers of a run with other ' + ', '.join(
                    f'{k} ({before.get(k)!r}, now {mine[k]!r})' for k in other)
                + '; give another folder with --json')
    write_whole(path, json.dumps(mine, indent=1) + '\n')


def _read(name, answers):
    """Return the row of an answer that is there; None where a bag is still to be diagnosed."""
    path = _answer(name, answers)
    if not path.exists():
        return None
    found = json.loads(path.read_text())
    return None if found['outcome'] == FAILED else row_of(name, found)


def row_of(name, found):
    """Return what the table says of an answer."""
    verdict = found.get('verdict') or {}
    return {'bag': name, 'outcome': found['outcome'],
            'effect': ' + '.join(verdict.get('effects', ())),
            'probability': verdict.get('probability'), 'reason': found['reason']}


def line_of(row):
    """Return a row as one line."""
    sure = '' if row['probability'] is None else probability_text(row['probability'])
    what = row['effect'] or (row['reason'].splitlines()[0] if row['outcome'] == FAILED else '-')
    return shown(f'{row["bag"]:<24} {row["outcome"]:<16} {sure:>6}  {what}')


def table(rows):
    """Return all rows as text, and how many have each outcome."""
    head = f'{"bag":<24} {"outcome":<16} {"prob.":>6}  effect'
    counts = {}
    for row in rows:
        counts[row['outcome']] = counts.get(row['outcome'], 0) + 1
    return '\n'.join([head, *map(line_of, rows),
                      ', '.join(f'{n} {outcome}' for outcome, n in sorted(counts.items()))])


def write_csv(path, rows):
    """Write the table as CSV."""
    with whole_file(path, newline='') as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows({k: _cell(v) for k, v in row.items()} for row in rows)


def _cell(value):
    """Return what a table may hold: one line, and no formula that a spreadsheet would work out."""
    if not isinstance(value, str):
        return value
    return shown(f"'{value}" if value[:1] in '=+-@\t\r' and value else value)
