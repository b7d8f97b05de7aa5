"""Records that a fit simulates, and what tests and fits make of them."""
