"""
The open-set test: statistics of changes that no effect of the library makes.

The spectrum of a record may be what a model expects while its motion is not: a frequency that
follows the amplitude, a gain that is modulated, a curve in one channel. Each statistic is a sum of
products of the adjoint of the record (what the samples ask for at some place of the model) and the
local motion there, standardised by the spectra that the model expects, so that it needs no record
of its own to compare with. The p-values of the families are joined to one by their Cauchy
combination.
"""
