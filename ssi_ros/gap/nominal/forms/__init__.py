"""Modal forms of effects, by site: filters of the channels and spectra added to them."""
