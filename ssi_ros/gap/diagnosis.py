"""The answer of a diagnosis, and its form as JSON."""
from dataclasses import asdict, dataclass

from ssi_ros.gap.comparison import Location
from ssi_ros.integrity.missing import Missing

SCHEMA = 'ssi_ros/diagnosis/1'
OUTCOMES = ('WITHIN_FLOOR', 'EXPLAINED', 'TIED', 'UNEXPLAINED', 'TOO_LITTLE_DATA')


@dataclass(frozen=True)
class Value:
    """A fitted number: value, standard deviation, 90 % interval, unit."""

    value: float
    std: float
    low90: float
    high90: float
    unit: str


@dataclass(frozen=True)
class Explanation:
    """
    One candidate: effects, how probable, at which values, and what it leaves of the gap.

    `closed` is the share of the gap above its floor that is removed, on data that the fit did not
    use; NaN where the gap is within three standard deviations of its floor.
    """

    effects: tuple
    probability: float
    alike: tuple
    parameters: dict
    gap_after: float
    closed: float
    closed_low90: float
    closed_high90: float
    inside_floor: bool
    built: tuple = ()


@dataclass(frozen=True)
class Diagnosis:
    """
    What `diagnose` found; the fields are those of the JSON, which `to_json` makes.

    `signs` are detections in sentences; `controls` say what no effect and one drawn at random
    remove, which shows what a reduction is worth; `missing` is of the record as it was given.
    `verdict` has the effects named, those that tie with them, their probability, and where there
    is a gap that of one more effect too small to be seen, `hidden`, a part of `unknown`.
    """

    outcome: str
    reason: str
    gap: dict
    where: Location
    candidates: tuple
    verdict: dict
    separate_by: tuple
    signs: tuple = ()
    controls: tuple = ()
    missing: Missing = Missing(channels={})

    def to_json(self):
        """Return plain data in the fixed schema; a number that is not finite becomes None."""
        return _plain({
            'schema': SCHEMA, 'outcome': self.outcome, 'reason': self.reason, 'gap': self.gap,
            'where': asdict(self.where), 'candidates': [{
                'effects': c.effects, 'probability': c.probability, 'class': c.alike,
                'parameters': {**_places(c.built),
                               **{k: vars(v) for k, v in c.parameters.items()}},
                'gap_after': c.gap_after, 'closed': c.closed, 'closed_low90': c.closed_low90,
                'closed_high90': c.closed_high90, 'inside_floor': c.inside_floor,
            } for c in self.candidates],
            'verdict': self.verdict, 'separate_by': self.separate_by, 'signs': self.signs,
            'controls': self.controls,
            'missing': {**vars(self.missing), 'text': self.missing.text}})


def _places(built):
    """Return channels and arrays of effects in the form of parameters, with a word for value."""
    return {f'{e.answer}.{f.name}': {'value': getattr(e, f.name), 'std': None, 'low90': None,
                                     'high90': None, 'unit': ''}
            for e in built for f in e.words()}


def _plain(value):
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(v) for v in value]
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return value
    number = float(value)
    return number if abs(number) < float('inf') else None
