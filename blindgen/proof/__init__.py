# Licensed under the Apache License, Version 2.0.
"""What binds a campaign: seal, register of campaigns, archive of answers."""
