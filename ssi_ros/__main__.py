"""Run the command line as `python -m ssi_ros`."""
import sys

from ssi_ros.cli.main import main

sys.exit(main())
