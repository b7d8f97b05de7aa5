"""What is wrong with the data themselves."""
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault of wiring, of units or of the recorder."""

    kind: str           # 'unit', 'swapped channels', 'reversed polarity', 'scan skew', ...
    sizes: dict         # by channel, or by the name of a quantity [see text]
    text: str           # one sentence: what was found, with size and unit
    p_value: float      # chance of it where nothing is wrong, after the trials factor


def as_reason(faults):
    """Return why such data cannot be compared, in one sentence; empty where there is no fault."""
    return '; '.join(f.text[0].lower() + f.text[1:].rstrip('.') for f in faults)
