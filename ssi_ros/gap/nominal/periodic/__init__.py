"""Two recordings of one periodic excitation, compared period by period."""
