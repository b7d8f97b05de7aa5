# Licensed under the Apache License, Version 2.0.
"""Running a tool on the cases of a campaign, over processes."""
