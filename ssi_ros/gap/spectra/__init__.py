"""From samples to spectra, recorded and expected."""
