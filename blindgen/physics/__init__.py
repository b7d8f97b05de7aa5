# Licensed under the Apache License, Version 2.0.
"""The second model of the spacecraft: plate, equations of motion, loads, sensors, record."""
