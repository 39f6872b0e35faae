"""How much evidence residuals are for a model: Akaike's and the Bayesian information criterion.

    AIC  = 2 k - 2 ln L          Akaike, IEEE Transactions on Automatic Control 19 (1974)
    AICc = AIC + 2 k (k + 1) / (n - k - 1)     Hurvich and Tsai, Biometrika 76 (1989)
    BIC  = k ln n - 2 ln L       Schwarz, Annals of Statistics 6 (1978)

k counts the noise's own size as a parameter too. L is the largest likelihood of the residuals:
normal noise for plain least squares; for robust losses Student's t with 5 degrees of freedom, so
that a few outliers, which every model misses alike, do not drown what the other points say.
"""

from __future__ import annotations

import numpy as np
from scipy.special import gammaln

from ..lens import Floats

TAIL = 5.0


def log_likelihood(residuals: Floats, loss: str, floor: float) -> float:
    """ln L at the noise that suits the residuals best, at least `floor`, in their unit."""
    return _normal(residuals, floor) if loss == "linear" else _student(residuals, floor)


def aic(log_l: float, k: int) -> float:
    return 2 * k - 2 * log_l


def aicc(log_l: float, k: int, n: int) -> float:
    """AIC for few points; infinite where there are too few to tell."""
    return aic(log_l, k) + 2 * k * (k + 1) / (n - k - 1) if n > k + 1 else float("inf")


def bic(log_l: float, k: int, n: int) -> float:
    return float(k * np.log(n) - 2 * log_l)


def _normal(residuals: Floats, floor: float) -> float:
    variance = max(float(np.mean(residuals**2)), floor**2)
    squares = float(np.sum(residuals**2)) / variance
    return float(-0.5 * (len(residuals) * np.log(2 * np.pi * variance) + squares))


def _student(residuals: Floats, floor: float) -> float:
    variance = max(float(np.median(np.abs(residuals))) ** 2, floor**2)
    for _ in range(100):  # its maximum, by expectation and maximisation
        weight = (TAIL + 1) / (TAIL + residuals**2 / variance)
        last, variance = variance, max(float(np.mean(weight * residuals**2)), floor**2)
        if abs(variance - last) < 1e-9 * last:
            break
    one = gammaln((TAIL + 1) / 2) - gammaln(TAIL / 2) - 0.5 * np.log(TAIL * np.pi * variance)
    tails = np.log1p(residuals**2 / (TAIL * variance))
    return float(len(residuals) * one - (TAIL + 1) / 2 * np.sum(tails))
