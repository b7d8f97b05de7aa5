# Licensed under the Apache License, Version 2.0.
"""What may be wrong with a spacecraft: the library's thirty effects, and families outside it."""
