"""Model updating: the errors of a model's numbers, fitted to recordings with their covariance."""
