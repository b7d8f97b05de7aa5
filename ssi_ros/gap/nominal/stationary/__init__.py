"""Detections in a recording under random excitation, each compared with the reference."""
