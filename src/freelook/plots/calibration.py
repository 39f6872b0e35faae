"""Figures of a calibration: what was seen where, and what does not fit."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..calibration.bundle import rms
from ..calibration.calibrate import Calibration
from ..calibration.uncertainty import grid_of, projection_uncertainty
from ..lens import Floats
from ._picture import draw_rings
from ._style import BLUE, ERRORS, FAINT, ORANGE, new_figure, panel, picture_panel, style

LONGEST_ARROW = 0.06  # of the picture's width: what the largest usual residual is drawn as
COLUMNS = 48  # of the uncertainty map


@style()
def coverage(calibration: Calibration) -> Figure:
    """Where corners were seen: in the picture, and by angle from the axis."""
    camera = calibration.camera
    figure = new_figure(11, 4.6)
    left = picture_panel(figure.add_subplot(1, 2, 1), "Corners in the picture", camera.size)
    for view, ok in zip(calibration.views, calibration.solution.inliers, strict=True):
        left.plot(*view.pixels[ok].T, ".", color=BLUE, markersize=2.5, alpha=0.7)
        left.plot(*view.pixels[~ok].T, "x", color=ORANGE, markersize=5)
    draw_rings(left, camera, FAINT)
    angles = np.degrees(point_angles(calibration))
    right = panel(
        figure.add_subplot(1, 2, 2), "Corners by angle", "angle from the axis, degrees", "corners"
    )
    right.hist(angles, bins=list(np.arange(0, angles.max() + 5, 5)), color=BLUE)
    return figure


@style()
def residuals(calibration: Calibration) -> Figure:
    """Residual vectors over the picture, enlarged, and residuals against angle."""
    pixels, vectors = counted(calibration)
    usual = float(np.percentile(np.hypot(*vectors.T), 95))
    enlarged = max(1.0, round(LONGEST_ARROW * calibration.camera.size[0] / max(usual, 1e-9)))
    figure = new_figure(11, 4.6)
    left = picture_panel(
        figure.add_subplot(1, 2, 1), f"Residuals, {enlarged:.0f} times", calibration.camera.size
    )
    left.quiver(
        *pixels.T,
        *vectors.T,
        angles="xy",
        scale_units="xy",
        scale=1 / enlarged,
        color=BLUE,
        width=0.0015,
    )
    draw_rings(left, calibration.camera, FAINT)
    right = panel(
        figure.add_subplot(1, 2, 2),
        "Residuals by angle",
        "angle from the axis, degrees",
        "residual, pixels (out is up)",
    )
    outward = pixels - calibration.camera.center
    outward = outward / np.maximum(np.hypot(*outward.T), 1e-9)[:, None]
    radial = np.sum(vectors * outward, axis=1)
    angles = np.degrees(point_angles(calibration))
    right.plot(angles, radial, ".", color=BLUE, markersize=2.5, alpha=0.5)
    right.axhline(0, color=FAINT)
    edges = np.arange(0, angles.max() + 5, 5)
    which = np.digitize(angles, edges)
    middles = [(edges[k - 1] + 2.5, float(np.mean(radial[which == k]))) for k in np.unique(which)]
    right.plot(*np.array(middles).T, color=ORANGE, label="mean of 5 degrees")
    right.legend()
    return figure


@style()
def per_view(calibration: Calibration) -> Figure:
    """RMS of every view, and the points of it that were dropped."""
    solution = calibration.solution
    rows = list(zip(solution.residuals, solution.inliers, strict=True))
    errors = [rms(r[ok]) for r, ok in rows]
    figure = new_figure(11, max(2.2, 0.26 * len(rows) + 1))
    axes = panel(figure.add_subplot(), "RMS of every view", "pixels (2-D, per point)", "")
    places = np.arange(len(rows))
    axes.barh(places, errors, color=BLUE)
    axes.axvline(calibration.rms_px, color=ORANGE, label=f"all views: {calibration.rms_px:.3f}")
    labels = [
        f"{short(view.name)}" + (f"  ({(~ok).sum()} dropped)" if (~ok).any() else "")
        for view, (_, ok) in zip(calibration.views, rows, strict=True)
    ]
    axes.set_yticks(places, labels)
    axes.invert_yaxis()
    axes.legend()
    return figure


@style()
def uncertainty(calibration: Calibration) -> Figure:
    """Standard deviation of the projection over the picture, as far as corners were seen."""
    camera = calibration.camera
    grid = grid_of(camera.size, COLUMNS)
    sigma = projection_uncertainty(camera, calibration.solution, calibration.freedom, grid).sigma_px
    figure = new_figure(7, 4.8)
    axes = picture_panel(
        figure.add_subplot(), "Uncertainty of the projection, one standard deviation", camera.size
    )
    shape = (-1, COLUMNS)
    image = axes.pcolormesh(
        grid[:, 0].reshape(shape),
        grid[:, 1].reshape(shape),
        sigma.reshape(shape),
        cmap=ERRORS,
        vmin=0,
        vmax=float(np.nanpercentile(sigma, 98)),
        shading="nearest",
    )
    figure.colorbar(image, ax=axes, label="pixels")
    draw_rings(axes, camera)
    return figure


def counted(calibration: Calibration) -> tuple[Floats, Floats]:
    """Pixels and residual vectors (n, 2) of all points that count."""
    solution = calibration.solution
    pixels = [v.pixels[ok] for v, ok in zip(calibration.views, solution.inliers, strict=True)]
    vectors = [r[ok] for r, ok in zip(solution.residuals, solution.inliers, strict=True)]
    return np.concatenate(pixels), np.concatenate(vectors)


def point_angles(calibration: Calibration) -> Floats:
    """Angle from the axis of all points that count, radians."""
    solution = calibration.solution
    seen = [
        pose.apply(view.points[ok])
        for pose, view, ok in zip(solution.poses, calibration.views, solution.inliers, strict=True)
    ]
    at = np.concatenate(seen)
    return np.asarray(np.arctan2(np.hypot(at[:, 0], at[:, 1]), at[:, 2]))


def short(name: str) -> str:
    """The end of a long file name."""
    last = name.replace("\\", "/").rsplit("/", 1)[-1]
    return last if len(last) <= 32 else "…" + last[-31:]
