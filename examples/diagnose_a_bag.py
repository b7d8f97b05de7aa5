"""Diagnose a bag and write a page: python examples/diagnose_a_bag.py BAG [PAGE.html]."""
from pathlib import Path
import sys

from ssi_ros.bag import read_channels
from ssi_ros.gap.diagnose import diagnose
from ssi_ros.model import load_spacecraft
from ssi_ros.report.diagnosis_page import diagnosis_page, view_of
from ssi_ros.report.samples import samples_of

spacecraft = load_spacecraft('config/spacecraft.yaml')
samples = samples_of(read_channels(sys.argv[1]), spacecraft.rate_hz)
found = diagnose(spacecraft, samples)
print(f'{found.outcome}: {found.reason}')
for c in found.candidates:
    print(f'  {" + ".join(c.effects)}: probability {c.probability:.3f}, closes {c.closed:.0%}')
page = diagnosis_page(found, view_of(found, spacecraft, samples), bag=sys.argv[1])
Path(sys.argv[2] if len(sys.argv) > 2 else 'diagnosis.html').write_text(page)
