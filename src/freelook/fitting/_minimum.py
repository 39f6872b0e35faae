"""Non-linear least squares as the fits here need it: scaled, robust, with its covariance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares, minimize

from ..errors import FitError
from ..lens import Floats

# Parameters (p,) to the residuals (n,) of the data, and to values (m,) that must not be negative.
Rows = Callable[[Floats], tuple[Floats, Floats]]

# Residuals of this many standard deviations are where a robust loss begins to differ from least
# squares: soft_l1 then keeps about 95 % of the efficiency on normal noise.
TURN = 1.5
# Where to stop, relatively, and after how many steps at the latest: to tell the deepest of several
# valleys, to see what leaving points out does, to have the answer.
ROUGH, FAIR, CLOSE = (1e-4, 20), (1e-7, 40), (1e-11, 100)
STIFF = 30.0  # a constraint missed by 0.01 costs as much as one residual of a third of the data
LOSSES = ("linear", "soft_l1", "cauchy")


@dataclass(frozen=True)
class Minimum:
    """Where the least squares ended.

    x         (p,) the parameters
    values    (n,) the residuals of the data there
    jacobian  (n, p) d values / d x
    step      (p,) changes of the parameters small enough for such differences
    loss      a name of `LOSSES`
    scale     the residual where the loss turns from square to robust
    forced    whether it is held to something that the data alone would not want
    """

    x: Floats
    values: Floats
    jacobian: Floats
    step: Floats
    loss: str
    scale: float
    forced: bool = False

    @property
    def rank(self) -> int:
        """How many combinations of parameters the data determine."""
        return len(self._determined[0])

    @property
    def undetermined(self) -> Floats:
        """(p,) bool: parameters that can change, others with them, without changing the fit."""
        _, axes, _ = self._determined
        return np.asarray(np.sum(axes**2, axis=0) < 1 - 1e-6)

    @cached_property
    def covariance(self) -> Floats:
        """(p, p): (J^T J)^-1 times the residual variance, of what the data determine.

        For a robust loss the variance is E psi^2 / (E psi')^2 (Huber, Robust Statistics, 1981,
        section 7.6). NaN where there are no more residuals than parameters.
        """
        singular, axes, size = self._determined
        half = axes / singular[:, None] / size
        return np.asarray(half.T @ half * self._variance)

    @cached_property
    def _determined(self) -> tuple[Floats, Floats, Floats]:
        """Singular values above nothing of J / size, their axes (rank, p), and size (p,)."""
        size = np.linalg.norm(self.jacobian, axis=0)
        size = np.where(size > 0, size, 1.0)
        _, singular, axes = np.linalg.svd(self.jacobian / size, full_matrices=False)
        kept = singular > 1e-9 * singular.max(initial=1e-300)
        return singular[kept], axes[kept], size

    @property
    def _variance(self) -> float:
        freedom = len(self.values) - self.rank
        if freedom <= 0:
            return float("nan")
        _, slope, curvature = _loss(self.loss, (self.values / self.scale) ** 2)
        flat = np.mean(slope + 2 * (self.values / self.scale) ** 2 * curvature)
        return float(np.sum((self.values * slope) ** 2) / freedom / flat**2)


def minimise(
    rows: Rows,
    start: Floats,
    *,
    size: float,
    loss: str = "linear",
    scale: float | None = None,
    effort: tuple[float, int] = CLOSE,
) -> Minimum:
    """The parameters that make the residuals smallest, from `start` on.

    rows    residuals, NaN where parameters make no sense; and constraints of the order of 1
    size    how large the fitted quantity is, in the residuals' unit: steps and the smallest noise
            believed (1e-9 of it) follow from it
    loss    "linear" for least squares, "soft_l1" or "cauchy" against outliers
    scale   where the loss turns; None: 1.5 robust standard deviations of the residuals, found
            along the way
    effort  ROUGH, FAIR or CLOSE

    FitError when the start makes no sense or the loss is unknown.
    """
    if loss not in LOSSES:
        raise FitError(f"unknown loss '{loss}'; known: {', '.join(LOSSES)}")
    problem = _Problem(rows, np.asarray(start, dtype=float), size)
    if loss == "linear":
        x = problem.solve(problem.start, loss, 1.0, effort)
        return problem.minimum(problem.finished(x, loss, 1.0, effort), loss, 1.0)
    x, turn = problem.start, scale or problem.turn(problem.start)
    for _ in range(0 if scale else 2 if effort == ROUGH else 12):
        x = problem.solve(x, loss, turn, ROUGH)
        last, turn = turn, problem.turn(x)
        if abs(turn - last) <= 0.02 * last:
            break
    x = problem.solve(x, loss, turn, effort)
    return problem.minimum(problem.finished(x, loss, turn, effort), loss, turn)


def spread(values: Floats, parameters: int = 0) -> float:
    """The standard deviation of most residuals, whatever the others do, after a fit.

    1.4826 times the median size; the residuals that a fit of so many parameters makes 0 do not
    count.
    """
    ordered = np.sort(np.abs(values))[min(parameters, len(values) - 1) :]
    return float(1.4826 * np.median(ordered))


def _loss(name: str, z: Floats) -> tuple[Floats, Floats, Floats]:
    """rho(z) of squared residuals z, with its two derivatives."""
    if name == "soft_l1":
        root = np.sqrt(1 + z)
        return 2 * (root - 1), 1 / root, -0.5 / root**3
    if name == "cauchy":
        return np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2
    return z, np.ones_like(z), np.zeros_like(z)


class _Problem:
    """The least squares in units in which every parameter moves the data alike."""

    def __init__(self, rows: Rows, start: Floats, size: float) -> None:
        self._parts = rows
        self.start, self._size = start, size
        self._count = len(self.values(start))
        self._bounds = len(rows(start)[1])
        if not np.isfinite(self.values(start)).all():
            raise FitError(f"the start {start.tolist()} of the fit makes no sense")
        self._unit = np.array([self._step(j) for j in range(len(start))])

    def values(self, x: Floats) -> Floats:
        with np.errstate(all="ignore"):
            return np.asarray(self._parts(x)[0], dtype=float)

    def turn(self, x: Floats) -> float:
        """Where a robust loss turns, by the residuals there."""
        return max(1e-9 * self._size, TURN * spread(self.values(x), len(x)))

    def solve(self, x: Floats, loss: str, turn: float, effort: tuple[float, int]) -> Floats:
        def rho(z: Floats) -> Floats:
            terms = np.stack(_loss(loss, z))
            plain = z[self._count :]
            terms[:, self._count :] = np.stack([plain, np.ones_like(plain), 0 * plain])
            return terms

        with np.errstate(under="ignore"):
            found = least_squares(
                lambda y: self._rows(x + y * self._unit) / turn,
                np.zeros_like(x),
                jac=lambda y: self._jacobian(x + y * self._unit) / turn,
                x_scale="jac",
                loss=rho if loss != "linear" else "linear",
                ftol=effort[0],
                xtol=effort[0],
                gtol=1e-15,
                max_nfev=effort[1],
            )
        return np.asarray(x + found.x * self._unit)

    def finished(self, x: Floats, loss: str, turn: float, effort: tuple[float, int]) -> Floats:
        """The last digits, along the long flat valleys and edges where trust regions creep."""
        if self._bounds and effort != ROUGH:
            return self._along_bounds(x, loss, turn)
        return self._whole_steps(x) if loss == "linear" and effort == CLOSE else x

    def _along_bounds(self, x: Floats, loss: str, turn: float) -> Floats:
        """Sequential quadratic programming (SciPy's SLSQP), which goes along its constraints.

        In directions in which the data are alike sensitive: it has no scaling of its own.
        """
        count = self._count
        _, size, axes = np.linalg.svd(self._jacobian(x)[:count] / turn / np.sqrt(count))
        size = np.maximum(size, 1e-9 * size[0])
        directions = self._unit[:, None] * axes.T / size

        def rows(w: Floats) -> Floats:
            return self._rows(x + directions @ w)[:count] / turn

        def cost(w: Floats) -> float:
            return float(np.mean(_loss(loss, rows(w) ** 2)[0]))

        def slope(w: Floats) -> Floats:
            values = rows(w)
            slopes = self._jacobian(x + directions @ w)[:count] / turn @ (axes.T / size)
            return np.asarray(2 * slopes.T @ (values * _loss(loss, values**2)[1]) / count)

        def slack(w: Floats) -> Floats:
            with np.errstate(all="ignore"):
                return np.nan_to_num(self._parts(x + directions @ w)[1], nan=-1.0)

        with np.errstate(all="ignore"):
            found = minimize(
                cost,
                np.zeros_like(x),
                jac=slope,
                method="SLSQP",
                constraints={"type": "ineq", "fun": slack},
                options={"maxiter": 100, "ftol": 1e-10 * max(cost(0 * x), 1e-12)},
            )
        better = cost(found.x) < cost(0 * x) or slack(0 * x).min() < -1e-6
        feasible = bool(slack(found.x).min() > -1e-6)
        return np.asarray(x + directions @ found.x) if better and feasible else x

    def _whole_steps(self, x: Floats) -> Floats:
        """A few whole Gauss-Newton steps, for models whose parameters nearly say the same."""
        rows = self._rows(x)
        for _ in range(20):
            step = np.linalg.lstsq(self._jacobian(x), -rows, rcond=1e-14)[0]
            for part in (1.0, 0.3, 0.1):
                changed = self._rows(x + part * step * self._unit)
                if changed @ changed < rows @ rows:
                    break
            else:
                return x
            better = 1 - (changed @ changed) / (rows @ rows)
            x, rows = x + part * step * self._unit, changed
            if better < 1e-6:
                break
        return x

    def minimum(self, x: Floats, loss: str, turn: float) -> Minimum:
        jacobian = self._jacobian(x)[: self._count] / self._unit
        return Minimum(x, self.values(x), jacobian, self._unit, loss, turn)

    def _rows(self, x: Floats) -> Floats:
        """Data, then constraints; something large where the parameters make no sense."""
        limit = 1e6 * self._size
        rows = np.nan_to_num(self._raw(x), nan=limit, posinf=limit, neginf=-limit)
        return np.clip(rows, -limit, limit)

    def _raw(self, x: Floats) -> Floats:
        with np.errstate(all="ignore"):
            values, slack = self._parts(x)
            return np.concatenate([values, STIFF * self._size * np.minimum(slack, 0)])

    def _jacobian(self, x: Floats) -> Floats:
        """d rows / d y, by central differences; one-sided where one side makes no sense."""
        here, columns = self._raw(x), []
        for unit in np.diag(self._unit):
            ahead, behind, steps = self._raw(x + unit), self._raw(x - unit), 2.0
            if not np.isfinite(ahead).all():
                ahead, steps = here, steps - 1
            if not np.isfinite(behind).all():
                behind, steps = here, steps - 1
            columns.append((ahead - behind) / max(steps, 1.0))
        return np.nan_to_num(np.stack(columns, axis=-1), nan=0.0, posinf=0.0, neginf=0.0)

    def _step(self, j: int) -> float:
        """The change of parameter j that moves the data by 1e-4 of their size, about.

        Central differences then err by about 1e-8 of a slope, rounding by 1e-11.
        """
        here, wanted = self.values(self.start), 1e-4 * self._size
        step, largest = 1e-3, 1e9
        for _ in range(40):
            moved = self.values(self.start + step * np.eye(len(self.start))[j]) - here
            if not np.isfinite(moved).all():
                largest = step
                step *= 0.1
                continue
            change = float(np.sqrt(np.mean(moved**2)))
            if wanted / 3 < change < 3 * wanted:
                break
            step = min(step * float(np.clip(wanted / max(change, 1e-30), 1e-4, 1e3)), largest / 3)
            if step > 1e6:  # it moves nothing
                return 1.0
        return step
