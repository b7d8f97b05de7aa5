# Licensed under the Apache License, Version 2.0.
"""All results of a revealed campaign: scores, curves, baselines, in FOLDER."""
from pathlib import Path

from blindgen.bag import read_bag
from blindgen.baselines import baselines
from blindgen.campaign import answers_of, labels_of
from blindgen.curves import draw, draw_confidence
from blindgen.report import BESIDE, report
from blindgen.score import score
from blindgen.seal import read_json, write_json
from blindgen.spread import spread
from blindgen.whittle import closed_by_truth


def results(folder, client=None, rounds=0, cache='.'):
    """
    Write scores.json, curves.png, confidence.png and report.md; return the scores.

    Parameters
    ----------
    folder : Path
        Of the campaign, revealed.
    client : distributed.Client
        Spreads what needs simulations; None does it here.
    rounds : int
        Of training of the baselines; 0 leaves them out.
    cache : Path
        Folder that keeps what the baselines learn from.

    """
    folder = Path(folder)
    labels, answers = labels_of(folder), answers_of(folder)
    told, public = read_json(folder / 'reveal.json'), read_json(folder / 'commitment.json')
    duration_s = public['duration_s']
    runs = {name: read_json(path) for name in labels
            if (path := folder / 'runs' / f'{name}.json').exists()}
    jobs = [(folder, name, labels[name], duration_s) for name in sorted(labels)
            if labels[name]['kind'] == 'single' and answers[name].closed is not None]
    (folder / 'closed').mkdir(exist_ok=True)
    truths = dict(spread(client, _closed, jobs, 'closed by the truth'))
    write_json(folder / 'closed.json', truths)
    scores = score(labels, answers, told['classes'], runs, truths, duration_s)
    if rounds:
        scores['baselines'] = {
            name: {key: value for key, value in score(labels, said, told['classes']).items()
                   if key in BESIDE or key == 'detected_by_d'}
            for name, said in baselines(folder, sorted(labels), duration_s, rounds, client,
                                        cache).items()}
    write_json(folder / 'scores.json', scores)
    draw(scores['curves'], folder / 'curves.png')
    draw_confidence(scores, folder / 'confidence.png')
    (folder / 'report.md').write_text('\n'.join(report(folder)) + '\n')
    return scores


def lines(scores):
    """Yield the scores as text, one a line."""
    for key, value in scores.items():
        if isinstance(value, dict) and 'low95' in value and value['value'] is not None:
            chance = f'  chance {value["chance"]:.2f}' if 'chance' in value else ''
            yield (f'{key:24s} {value["value"]:.3f}  [{value["low95"]:.3f}, '
                   f'{value["high95"]:.3f}]  of {value["total"]}{chance}')
        elif isinstance(value, dict) and 'largest' in value:
            yield f'{key:24s} median {value["median"]:.1f}, largest {value["largest"]:.1f}'
    for name, beside in scores.get('baselines', {}).items():
        yield f'{name:24s} ' + ', '.join(f'{key} {beside[key]["value"]:.2f}' for key in BESIDE
                                         if beside[key]['value'] is not None)
    yield f'{len(scores["failures"])} wrong answers; see scores.json'


def _closed(folder, name, label, duration_s):
    """Return the name and what its true effect closes, kept so that a killed score goes on."""
    path = Path(folder) / 'closed' / f'{name}.json'
    if not path.exists():
        write_json(path, closed_by_truth(*read_bag(Path(folder) / 'bags' / name), label,
                                         duration_s))
    return name, read_json(path)
