"""Single events in a recording."""
