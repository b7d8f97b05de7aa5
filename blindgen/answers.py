# Licensed under the Apache License, Version 2.0.
"""What a tool answered on a bag, read from its JSON; nothing of the tool is imported."""
from dataclasses import dataclass

from blindgen.seal import read_json

OUTCOMES = ('WITHIN_FLOOR', 'EXPLAINED', 'TIED', 'UNEXPLAINED', 'TOO_LITTLE_DATA')


@dataclass(frozen=True)
class Answer:
    """One answer: named effects are empty for none, unknown and no answer."""

    outcome: str
    effects: frozenset
    tied: frozenset           # the class of the verdict
    probability: float
    ranked: tuple             # frozensets of the candidates' effects, best first
    intervals: dict           # 'effect.parameter': (low90, high90) of the verdict's candidate
    site: str
    sensor: str


NO_ANSWER = Answer('NO_ANSWER', frozenset(), frozenset(), 0.0, (), {}, '', '')


def read_answer(path):
    """
    Return the answer in a file of schema ssi_ros/diagnosis/1.

    Raises
    ------
    ValueError
        If the schema or the outcome is unknown.

    """
    told = read_json(path)
    if told.get('schema') != 'ssi_ros/diagnosis/1' or told.get('outcome') not in OUTCOMES:
        raise ValueError(f'{path}: schema {told.get("schema")!r} and outcome '
                         f'{told.get("outcome")!r}; expected ssi_ros/diagnosis/1 and one of '
                         f'{", ".join(OUTCOMES)}')
    verdict = told.get('verdict') or {}
    named = told['outcome'] in ('EXPLAINED', 'TIED')
    effects = frozenset(verdict.get('effects') or [] if named else []) - {'none', 'unknown'}
    candidates = [c for c in told.get('candidates') or []
                  if not {'none', 'unknown'} & set(c['effects'])]
    best = next((c for c in candidates if frozenset(c['effects']) == effects), {})
    intervals = {key: (v['low90'], v['high90'])
                 for key, v in (best.get('parameters') or {}).items()
                 if isinstance(v, dict) and v.get('low90') is not None
                 and v.get('high90') is not None}
    where = told.get('where') or {}
    sites = where.get('site') or {}
    sensors = where.get('sensors') or []
    return Answer(
        told['outcome'], effects,
        (frozenset(verdict.get('class') or []) | effects) if named else frozenset(),
        float(verdict.get('probability') or 0.0),
        tuple(frozenset(c['effects']) for c in candidates), intervals,
        max(sites, key=sites.get) if sites else '',
        max(sensors, key=lambda s: s['share'])['name'] if sensors else '')
