# Licensed under the Apache License, Version 2.0.
"""How far an effect moves a record beyond all that a diagnosis may not know."""
