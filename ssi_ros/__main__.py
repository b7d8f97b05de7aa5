"""Run the command line as `python -m ssi_ros`."""
from pathlib import Path
import sys

# `python -m` puts the working folder first: a module that lies beside a bag is not to be run
if Path(sys.path[0]).resolve() == Path.cwd() != Path(__file__).resolve().parent.parent:
    del sys.path[0]

from ssi_ros.cli.main import main                     # noqa: E402, after the path is made safe

sys.exit(main())
