"""What was measured, with percentiles."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Figure:
    """Milliseconds of one path; `skipped` says why there are none."""

    name: str
    values_ms: list[float] = field(default_factory=list)
    skipped: str | None = None

    def percentile_ms(self, percent: float) -> float:
        """NaN when nothing was measured."""
        return float(np.percentile(self.values_ms, percent)) if self.values_ms else float("nan")
