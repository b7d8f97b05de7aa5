# Licensed under the Apache License, Version 2.0.
"""Scores of the answers, baselines beside them, and the report."""
