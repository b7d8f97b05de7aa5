# Licensed under the Apache License, Version 2.0.
"""What a tool answered on a bag, read from its JSON; nothing of the tool is imported."""
from dataclasses import dataclass, field

from blindgen.seal import read_json

OUTCOMES = ('WITHIN_FLOOR', 'EXPLAINED', 'TIED', 'UNEXPLAINED', 'TOO_LITTLE_DATA')


@dataclass(frozen=True)
class Answer:
    """One answer: named effects are empty for none, unknown and no answer."""

    outcome: str
    effects: frozenset = frozenset()
    tied: frozenset = frozenset()      # the class of the verdict
    probability: float = 0.0
    ranked: tuple = ()                 # frozensets of the candidates' effects, best first
    values: dict = field(default_factory=dict)      # 'effect.parameter' of the verdict's candidate
    intervals: dict = field(default_factory=dict)   # 'effect.parameter': (low90, high90)
    closed: float = None               # share of the gap that the verdict's candidate closes
    site: str = ''
    sensors: tuple = ()                # (name, share)
    bands: tuple = ()                  # (low_hz, high_hz, share)
    modes: tuple = ()                  # (frequency_hz, share)
    times: tuple = ()                  # (start_s, end_s, share)


NO_ANSWER = Answer('NO_ANSWER')


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
    values, intervals = {}, {}
    for key, value in (best.get('parameters') or {}).items():
        if isinstance(value, dict):
            values[key] = value.get('value')
            if value.get('low90') is not None and value.get('high90') is not None:
                intervals[key] = (value['low90'], value['high90'])
        else:
            values[key] = value
    where = told.get('where') or {}
    sites = where.get('site') or {}

    def shares(key, *names):
        return tuple(tuple(item[n] for n in (*names, 'share')) for item in where.get(key) or [])

    return Answer(
        told['outcome'], effects,
        (frozenset(verdict.get('class') or []) | effects) if named else frozenset(),
        float(verdict.get('probability') or 0.0),
        tuple(frozenset(c['effects']) for c in candidates), values, intervals,
        best.get('closed'), max(sites, key=sites.get) if sites else '',
        shares('sensors', 'name'), shares('bands', 'low_hz', 'high_hz'),
        shares('modes', 'frequency_hz'), shares('times', 'start_s', 'end_s'))
