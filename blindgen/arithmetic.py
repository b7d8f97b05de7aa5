# Licensed under the Apache License, Version 2.0.
"""
The same bits on every machine: which instructions the numerical libraries may use.

OpenBLAS, NumPy and Numba choose by processor, and another choice changes the last digits of every
sample, so that a case made again elsewhere would not have the committed hash. Those of a Haswell
of 2013 are on every x86-64 server since. They must be chosen before the libraries are loaded:
`python -m blindgen` starts itself again with them, and workers of a scheduler of one's own must be
started with them. A tool is run without them.
"""
import os
import sys

CHOSEN = {
    'OPENBLAS_CORETYPE': 'Haswell',
    'NUMBA_CPU_NAME': 'haswell',
    'NPY_DISABLE_CPU_FEATURES': ('AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL '
                                 'AVX512_SPR X86_V4')}
ONE_THREAD = {'OPENBLAS_NUM_THREADS': '1'}          # sums are cut up by threads


def start_again():
    """Replace this process by one with the chosen instructions, unless it has them."""
    wanted = {**os.environ, **CHOSEN, **ONE_THREAD}
    if wanted != dict(os.environ):
        os.execve(sys.executable, [sys.executable, '-m', 'blindgen', *sys.argv[1:]], wanted)


def without(environment):
    """Return an environment without the choice, for a tool."""
    return {key: value for key, value in environment.items() if CHOSEN.get(key) != value}
