# Licensed under the Apache License, Version 2.0.
"""Cases: a spacecraft, its model, healthy recordings and a recording with something in it."""
