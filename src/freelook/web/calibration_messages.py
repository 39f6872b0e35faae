"""What the calibration station tells its page, as data for JSON; pixels are of the full picture."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from ..calibration.live import LiveState, Progress
from ..calibration.live_coverage import COUNT, Sectors
from ..calibration.views import View
from ..lens import Floats


def state(live: LiveState) -> dict[str, Any]:
    """One look: what is in the picture, what has been seen, what is missing."""
    return {
        "size": list(live.size),
        "verdict": live.verdict,
        "sentence": live.sentence,
        "corners": pixels(live.found.pixels) if live.found else [],
        "held": round(live.held, 2),
        "views": len(live.views),
        "outlines": [outline(view) for view in live.views],
        "sectors": sectors(live.sectors),
        "filled": live.filled.tolist(),
        "hold": live.hold
        and {
            "sentence": live.hold.sentence,
            "outline": pixels(live.hold.outline),
            "sector": live.hold.about if isinstance(live.hold.about, int) else None,
        },
        "history": [progress(p) for p in live.history],
        "trouble": live.trouble,
        "enough": live.enough,
    }


def pixels(points: Floats) -> list[list[float] | None]:
    """Points (n, 2) to a tenth of a pixel; None where they are not seen."""
    finite = np.isfinite(points[:, 0] + points[:, 1])
    rounded = np.round(np.where(finite[:, None], points, 0.0), 1).tolist()
    return [point if ok else None for point, ok in zip(rounded, finite, strict=True)]


def outline(view: View) -> list[list[float] | None]:
    """The hull of a view's points."""
    hull = cv2.convexHull(view.pixels.astype(np.float32)).reshape(-1, 2)
    return pixels(hull.astype(np.float64))


def sectors(parts: Sectors) -> list[list[list[float] | None]]:
    return [pixels(parts.outline(number)) for number in range(COUNT)]


def progress(solved: Progress) -> dict[str, Any]:
    return {
        "views": solved.views,
        "rms_px": number(solved.rms_px),
        "left_out_px": number(solved.left_out_px),
        "uncertainty_px": number(solved.uncertainty_px),
    }


def number(value: float) -> float | None:
    """JSON has no NaN."""
    return round(float(value), 4) if np.isfinite(value) else None
