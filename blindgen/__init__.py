# Licensed under the Apache License, Version 2.0.
"""An independent generator of withheld cases; it shares no code with the package it checks."""
