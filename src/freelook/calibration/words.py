"""What a calibration found out: as figures, and in sentences for people."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..lens import Floats, model_name, parameters
from .bundle import rms
from .calibrate import Calibration


def figures(calibration: Calibration, without: list[str]) -> dict[str, Any]:
    """Everything, for JSON. RMS is that of 2-D distances per point, pixels."""
    solution, camera = calibration.solution, calibration.camera
    sigma = np.sqrt(np.diag(solution.covariance))
    return {
        "model": calibration.model,
        "size": list(camera.size),
        "parameters": parameters(camera.lens),
        "center": list(camera.center),
        "stretch": camera.stretch.tolist(),
        "field_deg": float(np.degrees(2 * camera.theta_max)),
        "seen_deg": float(np.degrees(calibration.seen_rad)),
        "rms_px": calibration.rms_px,
        "rms_all_px": rms(np.concatenate(solution.residuals)),
        "median_px": float(np.median(lengths(calibration))),
        "cross_validated_px": finite(calibration.cross_validated_px),
        "sigma": dict(zip(solution.names, map(float, sigma), strict=True)),
        "correlation": (solution.covariance / np.outer(sigma, sigma)).tolist(),
        "condition": solution.condition,
        "uncertainty_px": calibration.uncertainty_px,
        "together": solution.together,
        "doubts": list(calibration.doubts),
        "points": sum(len(view.pixels) for view in calibration.views),
        "points_dropped": calibration.rejected,
        "views": [
            {
                "name": view.name,
                "points": len(ok),
                "dropped": dropped_points(view.pixels, ok),
                "rms_px": rms(residuals[ok]),
            }
            for view, residuals, ok in zip(
                calibration.views, solution.residuals, solution.inliers, strict=True
            )
        ],
        "views_dropped": [{"name": n, "why": why} for n, why in calibration.dropped],
        "without_target": without,
        "candidates": [
            {
                "model": c.model,
                "rms_px": finite(c.rms_px),
                "cross_validated_px": finite(c.cross_validated_px),
                "why_not": c.why_not,
            }
            for c in calibration.candidates
        ],
    }


def lengths(calibration: Calibration) -> Floats:
    """Residual lengths of the points that count, pixels."""
    parts = zip(calibration.solution.residuals, calibration.solution.inliers, strict=True)
    counted = np.concatenate([residuals[ok] for residuals, ok in parts])
    return np.asarray(np.hypot(counted[:, 0], counted[:, 1]))


def finite(value: float) -> float | None:
    """None for NaN: JSON has none."""
    return float(value) if np.isfinite(value) else None


def dropped_points(pixels: Floats, ok: Any) -> list[list[float]]:
    return np.round(pixels[~ok], 2).tolist()


def sentences(calibration: Calibration) -> list[str]:
    """The result in words, the most important first."""
    solution, camera = calibration.solution, calibration.camera
    counted = lengths(calibration)
    held_out = calibration.cross_validated_px
    lines = [
        f"RMS {calibration.rms_px:.3f} px (2-D, per point), median {np.median(counted):.3f} px, "
        f"{len(counted)} points in {len(calibration.views)} views",
        f"on views left out: {held_out:.3f} px"
        if np.isfinite(held_out)
        else "too few views to test on views left out: take at least 3",
        f"{model_name(camera.lens)}, corners seen to "
        f"{np.degrees(calibration.seen_rad):.1f} degrees from the axis; "
        f"field {np.degrees(2 * camera.theta_max):.0f} degrees",
        f"where corners were seen, the projection is known to {calibration.uncertainty_px:.2f} px "
        "(standard deviation)",
    ]
    if solution.together > TOGETHER:
        lines.append(
            "errors of neighbouring corners go together: the views disagree "
            f"{solution.together:.1f} times as much as single errors would make them, which is "
            "taken into account; usual reasons are a board that is not quite flat, pictures taken "
            "in motion, and more than one camera or zoom"
        )
    lines += free_form_sentences(calibration)
    lines += [f"weak: {doubt}" for doubt in calibration.doubts]
    if calibration.rejected:
        share = calibration.rejected / sum(len(v.pixels) for v in calibration.views)
        lines.append(f"{calibration.rejected} points ({share:.1%}) dropped: too far from the rest")
    lines += [f"{name} not used: {why}" for name, why in calibration.dropped]
    if solution.condition > 1e9:
        lines.append("the views hardly determine all parameters: add tilted ones near the rim")
    return lines + [weakness for weakness in weaknesses(calibration)]


def free_form_sentences(calibration: Calibration) -> list[str]:
    """How a free-form lens compares with the one it is pulled towards, and what it says where no
    corner was seen."""
    free = next((c for c in calibration.candidates if c.instead_of and c.solution), None)
    if free is None:
        return []
    other = next(c for c in calibration.candidates if c.model == free.instead_of)
    lines = []
    if calibration.control:
        across, down = calibration.control
        lines.append(
            f"{across} x {down} control points; where no corner was seen, they stay near "
            f"{other.model}, which is all that their uncertainty says there"
        )
    fitted = f"({free.rms_px:.3f} against {other.rms_px:.3f} px)"
    predicted = f"({free.cross_validated_px:.3f} against {other.cross_validated_px:.3f} px)"
    if free.cross_validated_px < other.cross_validated_px:
        lines.append(f"{free.model} predicts views left out better than {other.model} {predicted}")
    elif free.cross_validated_px > other.cross_validated_px:
        better = f": {other.model} is the better lens" if calibration.control else ""
        lines.append(
            f"overfit: {free.model} fits these views closer than {other.model} {fitted}, but "
            f"predicts views left out worse {predicted}{better}"
        )
    return lines


TOGETHER = 2.0  # below, it may be chance

DIRECTIONS = (
    "right",
    "lower right",
    "bottom",
    "lower left",
    "left",
    "upper left",
    "top",
    "upper right",
)


def weaknesses(calibration: Calibration) -> list[str]:
    """Where corners are missing, and what to do about it."""
    camera = calibration.camera
    points = np.concatenate(
        [
            view.pixels[ok]
            for view, ok in zip(calibration.views, calibration.solution.inliers, strict=True)
        ]
    )
    offset = points - camera.center
    sector = np.round(np.degrees(np.arctan2(offset[:, 1], offset[:, 0])) / 45).astype(int) % 8
    rays = camera.ray(points)
    angle = np.degrees(np.arccos(np.clip(rays[:, 2], -1, 1)))
    edge = _edge_angles(camera)
    found = []
    for k, name in enumerate(DIRECTIONS):
        inside = angle[sector == k]
        reached = float(np.nanmax(inside)) if len(inside) and np.isfinite(inside).any() else 0.0
        if reached < 0.75 * edge[k]:
            found.append(
                f"no corner beyond {reached:.0f} of {edge[k]:.0f} degrees towards the {name}: "
                "hold the board there"
            )
    tilts = view_tilts_deg(calibration)
    if np.max(tilts) < 20:
        found.append(f"the board is never tilted by more than {np.max(tilts):.0f} degrees: tilt it")
    return found


def _edge_angles(camera: Any) -> Floats:
    """Degrees from the axis at the picture's edge or the field's end, in eight directions."""
    width, height = camera.size
    ends = []
    for k in range(8):
        way = np.array([np.cos(k * np.pi / 4), np.sin(k * np.pi / 4)])
        along = np.linspace(0, 2 * max(width, height), 2000)[:, None] * way + camera.center
        inside = (along > 0).all(1) & (along < np.array([width, height]) - 1).all(1)
        rays = camera.ray(along[inside])
        angle = np.degrees(np.arccos(np.clip(rays[:, 2], -1, 1)))
        ends.append(float(np.nanmax(angle)) if len(angle) else 0.0)
    return np.array(ends)


def view_tilts_deg(calibration: Calibration) -> Floats:
    """Angle between the target's normal and the ray to its middle, for each view."""
    tilts = []
    for pose, view in zip(calibration.solution.poses, calibration.views, strict=True):
        middle = pose.apply(view.points.mean(axis=0, keepdims=True))[0]
        normal = pose.camera_from_target.as_matrix()[:, 2]
        cosine = abs(float(normal @ middle)) / float(np.linalg.norm(middle))
        tilts.append(np.degrees(np.arccos(min(cosine, 1.0))))
    return np.array(tilts)
