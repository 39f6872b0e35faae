"""Where a polynomial first comes down to zero: the end of several models."""

from __future__ import annotations

import numpy as np


def first_zero(*ascending: float) -> float:
    """The smallest x > 0 with 1 + c1 x + c2 x^2 + ... = 0, given c1, c2, ...; infinite if none.

    Found as the largest 1/x, so that the leading coefficient is 1 however small the last one is.
    NaN for coefficients that are no finite numbers.
    """
    if not np.isfinite(ascending).all():
        return float("nan")
    with np.errstate(all="ignore"):
        zeros = np.roots([1.0, *ascending])
        real = zeros.real[np.abs(zeros.imag) <= 1e-9 * np.abs(zeros)]
        largest = float(real.max(initial=0.0))
    return 1 / largest if largest > 1e-300 else float("inf")
