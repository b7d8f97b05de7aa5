"""Which candidates explain the gap: search, evidence, held-out validation, conclusion."""
