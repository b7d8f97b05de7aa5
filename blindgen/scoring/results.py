# Licensed under the Apache License, Version 2.0.
"""All results of a revealed campaign: scores, curves, baselines and the report, in FOLDER."""
from pathlib import Path

from blindgen.cases.bag import read_bag
from blindgen.cases.draw import before, draw_case
from blindgen.cases.make import at_hand, scope_of
from blindgen.cases.plan import Case, scenario_of
from blindgen.proof.seal import read_json, write_json
from blindgen.run.campaign import labels_of, texts_of
from blindgen.run.spread import spread
from blindgen.scoring.baselines import baselines
from blindgen.scoring.curves import draw, draw_confidence
from blindgen.scoring.meter import closed_by_truth
from blindgen.scoring.report import BESIDE, report
from blindgen.scoring.score import score
from blindgen.verify import read_answer


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
    labels, texts = labels_of(folder), texts_of(folder)
    scope = scope_of(read_json(folder / 'commitment.json'))
    runs = {name: read_json(path) for name in labels
            if (path := folder / 'runs' / f'{name}.json').exists()}
    jobs = [(folder, name, labels[name], scope) for name in sorted(labels)
            if labels[name]['kind'] == 'single'
            and read_answer(texts.get(name))['closed'] is not None]
    truths = dict(spread(client, _closed, jobs, 'closed by the truth'))
    write_json(folder / 'closed.json', truths)
    durations = {name: draw_case(label['seed'], scope).duration_s
                 for name, label in labels.items()}
    scores = score(labels, texts, runs, truths, durations)
    if rounds:
        said = baselines(folder, labels, scope, rounds, client, cache)
        scores['baselines'] = {name: {key: value for key, value in score(labels, each).items()
                                      if key in BESIDE} for name, each in said.items()}
    write_json(folder / 'scores.json', scores)
    draw(scores['curves'], folder / 'curves.png')
    draw_confidence(scores, folder / 'confidence.png')
    (folder / 'report.md').write_text('\n'.join(report(folder)) + '\n')
    return scores


def lines(scores):
    """Yield the scores as text, one a line."""
    for key, value in scores.items():
        if isinstance(value, dict) and 'low95' in value and value['value'] is not None:
            ends = ('' if value['low95'] is None else
                    f'  [{value["low95"]:.3f}, {value["high95"]:.3f}]')
            chance = f'  chance {value["chance"]:.2f}' if 'chance' in value else ''
            yield f'{key:24s} {value["value"]:.3f}{ends}  of {value["total"]}{chance}'
        elif isinstance(value, dict) and 'largest' in value:
            yield f'{key:24s} median {value["median"]:.1f}, largest {value["largest"]:.1f}'
    for name, beside in scores.get('baselines', {}).items():
        yield f'{name:24s} ' + ', '.join(f'{key} {beside[key]["value"]:.2f}' for key in BESIDE
                                         if beside[key]['value'] is not None)
    yield f'{len(scores["failures"])} wrong answers; see scores.json'


def _closed(folder, name, label, scope):
    """Return the name and what its true effect closes, kept so that a killed score goes on."""
    path = Path(folder) / 'closed' / f'{name}.json'
    if not path.exists():
        draft = draw_case(label['seed'], scope)
        case = Case(**{**label, 'effects': tuple(label['effects'])})
        with at_hand(folder, name, label, scope) as made:
            bag = read_bag(made / 'bag', draft.nominal)
        write_json(path, closed_by_truth(before(label['seed'], draft), scenario_of(case, draft),
                                         *bag))
    return name, read_json(path)
