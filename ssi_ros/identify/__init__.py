"""SSI-COV on sliding windows: from accelerations to tracked modes."""
