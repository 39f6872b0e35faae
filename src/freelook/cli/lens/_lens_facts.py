"""All that `lens show` says about one lens, as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...camera import Camera
from ...formats import Profile
from ...lens import MODELS, Floats, growth_limit, model_name, parameters
from ...resolution import (
    Resolution,
    around_axis,
    fields_of_view,
    inside_picture,
    ray_at,
    resolution_towards,
)
from ...rotations import body_from_view, head_angles_deg
from ...view_cost import Spot, ViewCost, view_cost
from ...viewport import Viewport
from ._report import first_line, rounded

ANGLES_DEG = (45.0, 90.0)
AROUND = 72


@dataclass(frozen=True)
class View:
    """A view that somebody may want: where it looks, degrees right and up, and how."""

    name: str
    yaw_deg: float
    pitch_deg: float
    viewport: Viewport


USUAL = Viewport((1280, 720), 90.0)
USUAL_VIEWS = (View("forward", 0.0, 0.0, USUAL), View("60 left", -60.0, 0.0, USUAL))


def lens_facts(given: str, profile: Profile, views: Sequence[View]) -> dict[str, Any]:
    """Computed numbers have 6 digits; what stands in the profile stands here as it is."""
    camera = profile.camera
    return {
        "profile": given,
        "name": profile.name,
        "source": profile.source,
        "notes": list(profile.notes),
        "model": model_name(camera.lens),
        "formula": first_line(MODELS[model_name(camera.lens)]),
        "parameters": parameters(camera.lens),
        "size": list(camera.size),
        "center": list(camera.center),
        "stretch": camera.stretch.tolist(),
        "mount_deg": rounded(_mount(camera)),
        "field_deg": rounded(_fields(camera)),
        "grows_to_deg": rounded(float(np.degrees(growth_limit(camera.lens)))),
        "formula_ends_deg": rounded(float(np.degrees(camera.lens.hard_limit))),
        "residual_px": rounded(_residuals(camera)),
        "pixels_per_degree": rounded(_resolutions(camera)),
        "views": [rounded(_view(camera, view)) for view in views],
    }


def _mount(camera: Camera) -> dict[str, float]:
    angles = head_angles_deg(camera.camera_from_body.inv())
    # without the -0.0 and 1e-15 that inverting leaves behind
    return {n: round(a, 9) + 0.0 for n, a in zip(("yaw", "pitch", "roll"), angles, strict=True)}


def _fields(camera: Camera) -> dict[str, float]:
    fields = fields_of_view(camera)
    names = "horizontal vertical diagonal circle left right top bottom corner"
    return {name: float(getattr(fields, name)) for name in names.split()}


def _residuals(camera: Camera) -> dict[str, float | None]:
    grid = camera.grid.residual_px if camera.grid else None
    return {"table": camera.table.residual_px, "grid": grid}


def _resolutions(camera: Camera) -> list[dict[str, Any]]:
    """In the centre, at 45 and 90 degrees as far as the lens sees, and on its rim."""
    rim = float(np.degrees(camera.theta_max))
    places = [("centre", 0.0), *((f"{a:.0f}", a) for a in ANGLES_DEG if a < rim), ("rim", rim)]
    return [{"where": name, "angle_deg": angle, **_ring(camera, angle)} for name, angle in places]


def _ring(camera: Camera, angle_deg: float) -> dict[str, Any]:
    theta = min(np.radians(angle_deg), camera.theta_max * (1 - 1e-12))
    ray = ray_at(np.array(theta), around_axis(AROUND))
    there = resolution_towards(camera, np.array(theta), around_axis(AROUND))
    return {
        "radial": float(there.radial.mean()),
        "tangential": float(there.tangential.mean()),
        "least": float(there.least.min()),
        "most": float(there.most.max()),
        "share_in_picture": float(inside_picture(camera.project(ray), camera.size).mean()),
    }


def along(camera: Camera, count: int) -> tuple[Floats, Resolution]:
    """(radius in pixels, resolution to the right) at even steps of the angle, axis to rim."""
    theta = np.linspace(0, camera.theta_max * (1 - 1e-12), count)
    return camera.lens.radius(theta), resolution_towards(camera, theta, np.zeros(1))


def _view(camera: Camera, view: View) -> dict[str, Any]:
    turn = camera.camera_from_body * body_from_view(view.yaw_deg, view.pitch_deg)
    cost: ViewCost = view_cost(camera, turn, view.viewport)
    return {
        "name": view.name,
        "yaw_deg": view.yaw_deg,
        "pitch_deg": view.pitch_deg,
        "hfov_deg": view.viewport.hfov_deg,
        "vfov_deg": view.viewport.vfov_deg,
        "size": list(view.viewport.size),
        "view_pixels": cost.view_pixels,
        "view_px_per_degree": cost.view_px_per_degree,
        "source_pixels": cost.source_pixels,
        "share_of_picture": cost.source_pixels / cost.picture_pixels,
        "share_of_image": cost.source_pixels / cost.image_pixels if cost.image_pixels else 0.0,
        "seen": cost.seen,
        "enlarged": cost.enlarged,
        "shrunk": cost.shrunk,
        "largest_size_not_enlarged": list(cost.largest_size),
        "source_px_per_degree": _spots(cost.spots, "per_degree"),
        "source_px_per_view_px": _spots(cost.spots, "per_view_pixel"),
    }


def _spots(spots: dict[str, Spot], what: str) -> dict[str, list[float]]:
    return {name: list(getattr(spot, what)) for name, spot in spots.items()}
