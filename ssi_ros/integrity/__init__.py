"""Integrity of the data: faults of wiring, units and recorder, before any diagnosis."""
