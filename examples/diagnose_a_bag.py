"""Diagnose a bag and write a page: python examples/diagnose_a_bag.py BAG [PAGE.html]."""
from pathlib import Path
import sys

from ssi_ros.bag import read_channels
from ssi_ros.gap.driver import diagnose
from ssi_ros.model import load_spacecraft
from ssi_ros.quantity import probability_text
from ssi_ros.report.diagnosis_page import diagnosis_page, view_of
from ssi_ros.report.samples import samples_of
from ssi_ros.report.wording import headline

spacecraft = load_spacecraft('config/spacecraft.yaml')
samples = samples_of(read_channels(sys.argv[1]), spacecraft.rate_hz)
found = diagnose(spacecraft, samples)
print(f'{found.outcome}: {headline(found.to_json())}')
for c in found.candidates:
    print(f'  {" + ".join(c.effects)}: probability {probability_text(c.probability)}')
page = diagnosis_page(found, view_of(found, spacecraft, samples), bag=sys.argv[1])
Path(sys.argv[2] if len(sys.argv) > 2 else 'diagnosis.html').write_text(page)
