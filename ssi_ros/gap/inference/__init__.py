"""Likelihood, fit, tests and uncertainty."""
