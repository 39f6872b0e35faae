"""How the simulation's inner functions are compiled."""

from __future__ import annotations

from functools import partial

from numba import njit

# fast arithmetic that still respects infinities; IEEE division; other threads may run meanwhile
jit = partial(
    njit,
    fastmath={"contract", "reassoc", "nsz", "arcp"},
    error_model="numpy",
    nogil=True,
    cache=True,
)
