"""Spacecraft, excitation and sensors: from numbers to accelerations."""
