"""How the simulation's inner functions are compiled.

They must not meet infinities or NaN (the fast arithmetic assumes there are none); division
follows IEEE, without tests for zero; other threads may run meanwhile.
"""

from __future__ import annotations

import hashlib
from functools import partial
from pathlib import Path

from numba import njit

jit = partial(njit, fastmath=True, error_model="numpy", nogil=True)


def sources_digest() -> int:
    """A number that changes with any source file of this folder.

    Numba keeps compiled functions on disk and compiles them anew when their own file changes,
    but not when a function changes that they call. It does compare what a function encloses: a
    kept function that encloses this number is never out of date.
    """
    files = sorted(Path(__file__).parent.glob("*.py"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).digest()
    return int.from_bytes(digest[:7], "little")
