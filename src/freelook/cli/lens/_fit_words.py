"""What `lens fit` says about the fits: as plain data, and in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._report import digits, rounded

if TYPE_CHECKING:
    from ...fitting import CurveFit, PointFit
    from ._points_table import Table

    Fit = CurveFit | PointFit

# Differences in AICc below which models cannot be told apart, and beyond which one has next to no
# support: Burnham and Anderson, Model Selection and Multimodel Inference, 2002, section 2.6.
ALIKE, TOLD = 2.0, 10.0


def fit_facts(
    name: str, table: Table, fits: Sequence[Fit], refused: dict[str, str], best: Fit
) -> dict[str, Any]:
    """Ranked fits of a table, and the models that could not be fitted with the reasons."""
    first = fits[0].aicc
    theta, _ = best.measured
    lines = [line for line, out in zip(table.lines, best.outliers, strict=True) if out]
    return {
        "points": name,
        "count": len(table.lines),
        "angles_deg": rounded([float(np.degrees(theta.min())), float(np.degrees(theta.max()))]),
        "loss": best.loss,
        "best": best.model,
        "noise_px": rounded(best.noise_px),
        "outlier_lines": lines,
        "ranking": [_row(fit, first) for fit in fits],
        "not_fitted": refused,
    }


def _row(fit: Fit, first: float) -> dict[str, Any]:
    numbers = {
        "rms_px": fit.rms_px,
        "cv_rms_px": fit.cv_rms_px,
        "cv_ratio": fit.cv_ratio,
        "noise_px": fit.noise_px,
        "delta_aicc": fit.aicc - first if math.isfinite(first) else 0.0,
        "aicc": fit.aicc,
        "aic": fit.aic,
        "bic": fit.bic,
    }
    return {
        "model": fit.model,
        **rounded(numbers),
        "parameters": rounded(fit.values),
        "sigma": rounded(fit.sigma),
        "undetermined": list(fit.undetermined),
        "overfit": fit.overfit,
        "forced_to_grow": fit.forced,
    }


def print_fits(facts: dict[str, Any]) -> None:
    from rich.console import Console

    console = Console()
    low, high = facts["angles_deg"]
    print(f"{facts['points']}: {facts['count']} points from {low:g} to {high:g} degrees")
    console.print(_table(facts["ranking"]))
    for row in facts["ranking"]:
        if _delta(row) < TOLD or row["model"] == facts["best"]:
            print(f"{row['model']}: {_parameters(row)}")
    for line in _verdict(facts):
        console.print(line, highlight=False, soft_wrap=True, markup=False)


def _delta(row: dict[str, Any]) -> float:
    """Infinite where there are too few points for so many parameters."""
    return math.inf if row["delta_aicc"] is None else float(row["delta_aicc"])


def _table(rows: list[dict[str, Any]]) -> Any:
    from rich.table import Table as RichTable

    table = RichTable()
    table.add_column("model", no_wrap=True)
    for column in ("parameters", "rms px", "noise px", "cv rms px", "dAICc", "BIC"):
        table.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        cells = [digits(row[key]) for key in ("rms_px", "noise_px", "cv_rms_px")]
        criteria = [digits(row[key], ".1f") for key in ("delta_aicc", "bic")]
        table.add_row(row["model"], str(len(row["parameters"])), *cells, *criteria)
    return table


def _parameters(row: dict[str, Any]) -> str:
    """Each with as many digits as its standard deviation leaves."""
    return ", ".join(
        f"{name} {_with_sigma(value, row['sigma'][name])}"
        for name, value in row["parameters"].items()
    )


def _with_sigma(value: float, sigma: float | None) -> str:
    if sigma is None:
        return f"{value:.4g} ± ?"
    if sigma <= 0:
        return f"{value:.6g}"
    places = min(max(0, 1 - math.floor(math.log10(sigma))), 15)
    return f"{value:.{places}f} ± {sigma:.2g}"


def _verdict(facts: dict[str, Any]) -> list[str]:
    rows, best = facts["ranking"], facts["best"]
    by_name = {row["model"]: row for row in rows}
    alike = [row["model"] for row in rows if _delta(row) < ALIKE]
    said = [f"best: {best}, noise {digits(facts['noise_px'])} px"]
    others = ", ".join(name for name in alike if name != best)
    if others and best in alike:
        said.append(f"cannot be told apart from it by these points (AICc within 2): {others}")
    elif others:
        said.append(f"AICc alone would take {others}, which is overfit")
    over = [f"{row['model']} ({row['cv_ratio']:.1f} times)" for row in rows if row["overfit"]]
    if over:
        said.append(
            "overfit, predict points they have not seen much worse than those they have: "
            + ", ".join(over)
        )
    forced = [row["model"] for row in rows if row["forced_to_grow"]]
    if forced:
        said.append(f"would stop growing inside the data, and were held: {', '.join(forced)}")
    if by_name[best]["undetermined"]:
        said.append(f"not determined by these points: {', '.join(by_name[best]['undetermined'])}")
    if facts["outlier_lines"]:
        said.append(f"outliers, look at line {', '.join(map(str, facts['outlier_lines']))}")
    return said + _not_fitted(facts["not_fitted"])


def _not_fitted(refused: dict[str, str]) -> list[str]:
    """One line for each reason."""
    by_reason: dict[str, list[str]] = {}
    for name, why in refused.items():
        by_reason.setdefault(why.removeprefix(f"{name} "), []).append(name)
    return [f"not fitted: {', '.join(names)}: {why}" for why, names in by_reason.items()]
