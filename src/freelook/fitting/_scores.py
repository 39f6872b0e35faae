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
from ._minimum import Minimum, spread
from ._models import Bools

TAIL = 5.0
OVERFIT = 1.5


def log_likelihood(residuals: Floats, loss: str, floor: float) -> float:
    """ln L at the noise that suits the residuals best, at least `floor`, in their unit."""
    return _normal(residuals, floor) if loss == "linear" else _student(residuals, floor)


class Scored:
    """What a fit says about its parameters and about itself, from the minimum it ended in."""

    names: tuple[str, ...]
    residuals_px: Floats
    _minimum: Minimum

    @property
    def cv_residuals_px(self) -> Floats:
        raise NotImplementedError

    @property
    def _log_likelihood(self) -> float:
        raise NotImplementedError

    @property
    def values(self) -> dict[str, float]:
        """The fitted parameters by name."""
        return dict(zip(self.names, map(float, self._minimum.x), strict=True))

    @property
    def covariance(self) -> Floats:
        """(p, p) of the fitted parameters; the size of the noise is taken from the residuals."""
        return self._minimum.covariance

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters that the data do not determine."""
        pairs = zip(self.names, self._minimum.undetermined, strict=True)
        return tuple(name for name, so in pairs if so)

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviations of the parameters; infinite where the data do not determine one."""
        sigma = np.sqrt(np.diag(self.covariance))
        unknown = self._minimum.undetermined
        pairs = zip(self.names, np.where(unknown, np.inf, sigma), strict=True)
        return {name: float(value) for name, value in pairs}

    @property
    def loss(self) -> str:
        return self._minimum.loss

    @property
    def forced(self) -> bool:
        """Whether the data alone would want a radius that stops growing, and it was kept growing.

        The parameters' uncertainty means little then.
        """
        return self._minimum.forced

    @property
    def noise_px(self) -> float:
        """The standard deviation of most residuals, per coordinate; outliers do not count."""
        return spread(self._residuals, len(self.names))

    @property
    def rms_px(self) -> float:
        """Root mean square of the residuals: of distances, where those have two coordinates."""
        return _rms(self.residuals_px)

    @property
    def cv_rms_px(self) -> float:
        """Root mean square of `cv_residuals_px`: how well unmeasured points are predicted."""
        return _rms(self.cv_residuals_px)

    @property
    def exact(self) -> bool:
        """Whether there is no noise to speak of: not a millionth of the data's extent."""
        return self.noise_px < 1e-6 * self._size_px

    @property
    def outliers(self) -> Bools:
        """(n,) bool: points farther off than five times the noise."""
        off_px = _lengths(self.residuals_px)
        return np.asarray(off_px > 5 * self.noise_px) & (not self.exact)

    @property
    def cv_ratio(self) -> float:
        """How many times farther off points are that the fit has not seen; outliers left out."""
        kept = ~self.outliers
        seen = _rms(self.residuals_px[kept])
        return 1.0 if self.exact else _rms(self.cv_residuals_px[kept]) / seen

    @property
    def overfit(self) -> bool:
        """Whether there are too many parameters for so few points: a ratio above 1.5.

        That is what one parameter for every three points gives.
        """
        return self.cv_ratio > OVERFIT

    @property
    def aic(self) -> float:
        return 2 * self._k - 2 * self._log_likelihood

    @property
    def aicc(self) -> float:
        """AIC corrected for few points; infinite where there are too few to tell."""
        k, n = self._k, len(self._residuals)
        return self.aic + 2 * k * (k + 1) / (n - k - 1) if n > k + 1 else float("inf")

    @property
    def bic(self) -> float:
        return float(self._k * np.log(len(self._residuals)) - 2 * self._log_likelihood)

    @property
    def _size_px(self) -> float:
        """How far the measured pixels extend."""
        raise NotImplementedError

    @property
    def _residuals(self) -> Floats:
        return self._minimum.values

    @property
    def _k(self) -> int:
        return self._minimum.rank + 1


def _lengths(residuals: Floats) -> Floats:
    return np.asarray(np.linalg.norm(residuals.reshape(len(residuals), -1), axis=1))


def _rms(residuals: Floats) -> float:
    return float(np.sqrt(np.mean(_lengths(residuals) ** 2)))


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
