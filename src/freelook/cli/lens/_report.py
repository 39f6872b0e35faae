"""How the lens commands put numbers: the same facts as JSON and in words."""

from __future__ import annotations

import json
import math
from typing import Any

SPARKS = "▁▂▃▄▅▆▇█"


def print_json(data: Any) -> None:
    print(json.dumps(data, indent=2))


def rounded(value: Any) -> Any:
    """Every number in it to 6 digits, so that two machines print the same; NaN becomes None."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(each) for each in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value


def percent(share: float) -> str:
    """0 to 1 as percent; what is not quite all or nothing does not look so."""
    if 0 < share < 0.001 or 0.999 < share < 1:
        return "< 0.1 %" if share < 0.5 else "> 99.9 %"
    return f"{100 * share:.1f} %"


def digits(value: float | None, form: str = "") -> str:
    """The number, with three digits unless `form` says otherwise; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    return format(value, form or (",.0f" if abs(value) >= 999.5 else "#.3g")).rstrip(".")


def span(low_high: tuple[float | None, float | None] | list[float | None]) -> str:
    """From least to most; one number if they look the same."""
    low, high = (digits(value) for value in low_high)
    return low if low == high else f"{low} to {high}"


def spark(values: list[float]) -> str:
    """Columns of text whose heights grow with the values, from 0."""
    top = max(values)
    steps = [int(value / top * (len(SPARKS) - 1) + 0.5) if top > 0 else 0 for value in values]
    return "".join(SPARKS[step] for step in steps)


def first_line(of: object) -> str:
    """What its docstring begins with: of a lens model the formula, of a format what it is."""
    return (of.__doc__ or "").strip().splitlines()[0].rstrip(".")
