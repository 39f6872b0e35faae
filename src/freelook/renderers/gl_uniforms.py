"""What view.glsl is told of camera, view and picture: defines and uniforms, in this one place."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..color import yuv_from_rgb_matrix
from ..types import ColorSpace
from ..viewport import Viewport
from .gl_shader import Value

# texture units
LUMA_UNIT, U_UNIT, V_UNIT, LENS_UNIT, OFFSETS_UNIT = range(5)


def camera_defines(camera: Camera) -> set[str]:
    return {"BENT"} if camera.grid else set()


def camera_uniforms(camera: Camera) -> dict[str, Value]:
    """Its table is in the texture of `LENS_UNIT`, its grid, if any, in that of `OFFSETS_UNIT`."""
    return {
        "lens_g": LENS_UNIT,
        "lens_t_max": camera.table.t_max,
        "lens_center": camera.center,
        "lens_stretch": camera.stretch.astype(np.float32),
        "lens_offsets": OFFSETS_UNIT,
        "lens_p_max": camera.grid.p_max if camera.grid else 1.0,
    }


def view_defines(viewport: Viewport) -> set[str]:
    """The formula of its rays; none for a perspective view."""
    if viewport.kind.cut:
        return {"CUT"}
    formula = viewport.kind.formula
    return set() if formula == "perspective" else {formula.upper()}


def view_uniforms(viewport: Viewport, camera_from_view: Rotation) -> dict[str, Value]:
    width, height = viewport.size
    return {
        "view_center": ((width - 1) / 2, (height - 1) / 2),
        "view_focal_px": viewport.focal_px,
        "camera_from_view": camera_from_view.as_matrix().astype(np.float32),
    }


def color_uniforms(color: ColorSpace) -> dict[str, Value]:
    """RGB from Y, U, V as textures give them: 0 to 1 for code values 0 to 255."""
    matrix, offset = yuv_from_rgb_matrix(color)
    return {
        "rgb_from_yuv": (np.linalg.inv(matrix) * 255).astype(np.float32),
        "yuv_offset": tuple(offset / 255),
    }


def most_shrunk(camera: Camera, viewport: Viewport) -> float:
    """Picture pixels per view pixel, at most, wherever the camera may look: an estimate from
    above, from where the lens is finest and where the view is coarsest."""
    if viewport.kind.cut:  # one focal length is one of the lens
        per_px = float(camera.table.g[0]) / 2 / viewport.focal_px
        return per_px * float(np.linalg.norm(camera.stretch, 2))
    return _finest_px_per_rad(camera) * _coarsest_rad_per_px(viewport)


def _finest_px_per_rad(camera: Camera) -> float:
    theta = np.linspace(0.0, camera.theta_max, 65)
    radius = camera.lens.radius(theta)
    radial = np.diff(radius) / np.diff(theta)
    tangential = radius[1:] / np.maximum(np.sin(theta[1:]), 0.5)
    stretch = np.linalg.norm(camera.stretch, 2)
    return float(max(radial.max(), tangential.max()) * stretch)


def _coarsest_rad_per_px(viewport: Viewport) -> float:
    """Between rays spread evenly over the view: right for any projection."""
    width, height = viewport.size
    across, down = (np.linspace(0, side - 1, min(side, 33)) for side in (width, height))
    rays = viewport.rays_at(np.stack(np.meshgrid(across, down), axis=-1))
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    steps = [(0, down[1] - down[0]), (1, across[1] - across[0])]
    apart = [np.linalg.norm(np.diff(rays, axis=axis), axis=-1).max() / px for axis, px in steps]
    return float(max(apart))
