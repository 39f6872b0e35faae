"""How the simulation's inner functions are compiled.

They must not meet infinities or NaN (the fast arithmetic assumes there are none); division
follows IEEE, without tests for zero; other threads may run meanwhile.
"""

from __future__ import annotations

from functools import partial

from numba import njit

jit = partial(njit, fastmath=True, error_model="numpy", nogil=True, cache=True)
