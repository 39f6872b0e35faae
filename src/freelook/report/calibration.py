"""The report of a calibration: is it good, where is it weak, what does it do to a picture."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from ..calibration.calibrate import Calibration
from ..calibration.parameters import Parameters
from ..calibration.views import View
from ..calibration.words import sentences, weaknesses
from ..plots import calibration as plots
from ..renderers.cpu import coordinates
from ..rotations import RDF_FROM_FRD, body_from_view
from ..viewport import Viewport
from .html import Page

Gray = NDArray[np.uint8]
LARGEST_SIDE = 900  # of pictures in the report, pixels
VIEW = Viewport((720, 540), 110.0)

COVERAGE = "Blue: used. Crosses: dropped. Rings: 30, 60, 90 degrees and the field's end."
RESIDUALS = (
    "Arrows without a pattern are noise; a pattern is a lens the model cannot follow, or a board "
    "that is not flat."
)
PER_VIEW = "A view that stands out was moved, blurred, or found wrongly."
UNCERTAINTY = (
    "What is left of the parameters' uncertainty when the camera may turn to undo it. Bright: more "
    "views with corners there would help most."
)


def calibration_page(
    calibration: Calibration, pictures: Mapping[str, Gray], title: str = "Lens calibration"
) -> str:
    """The HTML text. `pictures` are those of the views, by name, as far as there are any."""
    page = Page(title)
    key, *others = sentences(calibration)
    weak = set(weaknesses(calibration))
    page.paragraph(key, "key")
    for line in others:
        page.paragraph(line, "weak" if line in weak else "")
    shown = _typical(calibration, pictures)
    if shown is not None:
        _before_and_after(page, calibration, shown, pictures[shown.name])
    page.heading("Where corners were seen")
    page.figure(
        plots.coverage(calibration),
        COVERAGE,
    )
    page.heading("What does not fit")
    page.figure(
        plots.residuals(calibration),
        RESIDUALS,
    )
    page.figure(plots.per_view(calibration), PER_VIEW)
    page.heading("How sure it is")
    page.figure(
        plots.uncertainty(calibration),
        UNCERTAINTY,
    )
    _values(page, calibration)
    _models(page, calibration)
    return page.text()


def _typical(calibration: Calibration, pictures: Mapping[str, Gray]) -> View | None:
    """The view whose corners reach farthest out among those with a picture."""
    center = np.array(calibration.camera.center)
    with_picture = [view for view in calibration.views if view.name in pictures]
    return max(
        with_picture,
        key=lambda view: float(np.hypot(*(view.pixels - center).T).max()),
        default=None,
    )


def _before_and_after(page: Page, calibration: Calibration, view: View, gray: Gray) -> None:
    index = calibration.views.index(view)
    marked = cv2.cvtColor(gray, cv2.COLOR_GRAY2RGB)
    radius = max(2, round(gray.shape[1] / 400))
    for (x, y), ok in zip(view.pixels, calibration.solution.inliers[index], strict=True):
        color = (0, 158, 115) if ok else (213, 94, 0)
        cv2.circle(marked, (round(x), round(y)), radius, color, -1, cv2.LINE_AA)
    scale = min(1.0, LARGEST_SIDE / max(gray.shape))
    small = cv2.resize(marked, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    page.heading("Before and after")
    found = f"{plots.short(view.name)}: corners used (green), dropped (orange)"
    seen = f"a virtual camera of {VIEW.hfov_deg:.0f} degrees: the board's lines are straight"
    view_of_it = _rectified(calibration, view, gray, index)
    page.pictures([(small.astype(np.uint8), found), (view_of_it, seen)])


def _rectified(calibration: Calibration, view: View, gray: Gray, index: int) -> Gray:
    """A view towards the board."""
    middle = calibration.solution.poses[index].apply(view.points.mean(axis=0, keepdims=True))[0]
    yaw = float(np.degrees(np.arctan2(middle[0], middle[2])))
    pitch = float(np.degrees(np.arctan2(-middle[1], np.hypot(middle[0], middle[2]))))
    camera_from_view = RDF_FROM_FRD * body_from_view(yaw, pitch)
    x, y = coordinates(calibration.camera, camera_from_view, VIEW)
    x, y = (np.nan_to_num(c, nan=-1e4) for c in (x, y))
    return np.asarray(cv2.remap(gray, x, y, cv2.INTER_LINEAR), dtype=np.uint8)


def _values(page: Page, calibration: Calibration) -> None:
    if calibration.control:  # hundreds, that say nothing by themselves
        return
    solution = calibration.solution
    values = Parameters(solution.camera, calibration.freedom).values
    sigma = np.sqrt(np.diag(solution.covariance))
    page.heading("Parameters")
    page.table(
        ["parameter", "value", "standard deviation"],
        [
            [name, f"{value:.6g}", f"{spread:.2g}"]
            for name, value, spread in zip(solution.names, values, sigma, strict=True)
        ],
    )


def _models(page: Page, calibration: Calibration) -> None:
    if len(calibration.candidates) < 2:
        return
    page.heading("Models tried")
    page.table(
        ["model", "RMS, px", "on views left out, px", ""],
        [
            [c.model, "", "", c.why_not]
            if c.solution is None
            else [
                c.model,
                f"{c.rms_px:.3f}",
                f"{c.cross_validated_px:.3f}",
                "chosen" if c.model == calibration.model else c.remark,
            ]
            for c in calibration.candidates
        ],
    )
