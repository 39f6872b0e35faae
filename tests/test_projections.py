"""The projections by what they are known for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freelook.errors import RenderError
from freelook.lens import Floats
from freelook.projections import PROJECTIONS, Projection
from freelook.viewport import Viewport, fitting

BY_RAYS = [kind for kind in PROJECTIONS.values() if not kind.cut]
ALL = list(PROJECTIONS.values())


def view(name: str, hfov_deg: float, size: tuple[int, int] = (401, 101)) -> Viewport:
    return Viewport(size, hfov_deg, name)


def fields(kind: Projection) -> list[float]:
    return [kind.narrowest_deg, (kind.narrowest_deg + kind.widest_deg) / 2, kind.widest_deg]


def angle_deg(ray: Floats) -> Floats:
    """From straight ahead."""
    return np.degrees(np.arctan2(np.hypot(ray[..., 0], ray[..., 1]), ray[..., 2]))


def unit(ray: Floats) -> Floats:
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def straightness(points: Floats) -> float:
    """How far points (n, 2) are from one straight line, over their spread."""
    _, spread, _ = np.linalg.svd(points - points.mean(axis=0))
    return float(spread[1] / spread[0])


@pytest.mark.parametrize("kind", BY_RAYS, ids=lambda kind: kind.name)
def test_the_middle_looks_ahead_and_the_edges_half_the_field_to_the_side(kind: Projection) -> None:
    for hfov_deg in fields(kind):
        shown = view(kind.name, hfov_deg, (401, 11))
        assert angle_deg(shown.rays()[5, 200]) == pytest.approx(0, abs=1e-9)
        left, right = shown.rays_at(np.array([[-0.5, 5.0], [400.5, 5.0]]))
        for ray, sign in ((left, -1), (right, 1)):
            azimuth = np.degrees(np.arctan2(ray[0], ray[2])) * sign
            assert azimuth % 360 == pytest.approx(hfov_deg / 2)
            assert ray[1] == pytest.approx(0)


@pytest.mark.parametrize("kind", BY_RAYS, ids=lambda kind: kind.name)
def test_the_vertical_field_is_that_of_the_middle_column(kind: Projection) -> None:
    shown = view(kind.name, max(120.0, kind.narrowest_deg))
    top, bottom = shown.rays_at(np.array([[200, -0.5], [200, 100.5]]))
    assert angle_deg(top) + angle_deg(bottom) == pytest.approx(shown.vfov_deg)
    assert top[1] < 0 < bottom[1]


@pytest.mark.parametrize("kind", BY_RAYS, ids=lambda kind: kind.name)
def test_pixels_are_square_in_the_middle_and_as_large_as_the_focal_length_says(
    kind: Projection,
) -> None:
    shown = view(kind.name, kind.narrowest_deg)
    ahead = unit(shown.rays())[49:52, 199:202]
    per_pixel = 1 / shown.focal_px
    # a central difference strays by the square of the step, a sixth of it at most
    assert (ahead[1, 2, 0] - ahead[1, 0, 0]) / 2 == pytest.approx(per_pixel, rel=per_pixel**2)
    assert (ahead[2, 1, 1] - ahead[0, 1, 1]) / 2 == pytest.approx(per_pixel, rel=per_pixel**2)


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
def test_places_are_found_again_from_their_rays(kind: Projection, rng: np.random.Generator) -> None:
    place = rng.uniform(-1.2, 1.2, (200, 2))
    ray = kind.ray(place[:, 0], place[:, 1])
    np.testing.assert_allclose(kind.place(3 * ray), place, atol=1e-12)
    assert kind.angle_deg(kind.half_width(40), 0) == pytest.approx(40)
    assert kind.angle_deg(0, kind.half_height(40)) == pytest.approx(40)


def test_perspective_and_pannini_show_nothing_straight_behind() -> None:
    behind = np.array([0.0, 0.0, -1.0])
    for name in ("perspective", "pannini", "stereographic"):
        assert np.isnan(PROJECTIONS[name].place(behind)).all()


def test_stereographic_views_keep_angles() -> None:
    """The two slopes of a place are as long as each other, and at right angles."""
    kind, step = PROJECTIONS["stereographic"], 1e-5
    x, y = np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-2, 2, 5))
    across = (unit(kind.ray(x + step, y)) - unit(kind.ray(x - step, y))) / (2 * step)
    down = (unit(kind.ray(x, y + step)) - unit(kind.ray(x, y - step))) / (2 * step)
    np.testing.assert_allclose((across * down).sum(-1), 0, atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.norm(across, axis=-1), np.linalg.norm(down, axis=-1), atol=1e-9
    )


UPRIGHT = np.stack([np.full(21, 2.0), np.linspace(-3, 3, 21), np.full(21, 0.5)], axis=-1)


@pytest.mark.parametrize("name", ["perspective", "cylindrical", "pannini"])
def test_upright_lines_stay_upright(name: str) -> None:
    across = PROJECTIONS[name].place(UPRIGHT)[:, 0]
    np.testing.assert_allclose(across, across[0], atol=1e-12)


def test_upright_lines_bend_elsewhere() -> None:
    assert straightness(PROJECTIONS["stereographic"].place(UPRIGHT)) > 0.02


def test_pannini_views_keep_lines_through_the_middle_straight() -> None:
    """Level ones towards the vanishing point: of a street one stands in the middle of."""
    depth = np.linspace(0.3, 30, 40)
    street = np.stack([np.full(40, 1.5), np.full(40, 1.0), depth], axis=-1)
    place = PROJECTIONS["pannini"].place(street)
    slopes = place[:, 1] / place[:, 0]
    np.testing.assert_allclose(slopes, slopes[0], rtol=1e-12)
    bent = PROJECTIONS["cylindrical"].place(street)
    assert np.ptp(bent[:, 1] / bent[:, 0]) > 0.1


@pytest.mark.parametrize("name", ["equirectangular", "strip"])
def test_equirectangular_views_are_linear_in_both_angles(name: str) -> None:
    shown = Viewport((361, 89), 360, name)
    rays = shown.rays()
    azimuth = np.degrees(np.arctan2(rays[..., 0], rays[..., 2]))
    elevation = np.degrees(np.arcsin(rays[..., 1]))
    np.testing.assert_allclose(np.diff(azimuth, axis=1), 360 / 361)
    np.testing.assert_allclose(np.diff(elevation, axis=0), 360 / 361)


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
def test_fields_beyond_a_projections_limits_are_refused(kind: Projection) -> None:
    for hfov_deg in (kind.narrowest_deg - 0.1, kind.widest_deg + 0.1, np.nan):
        with pytest.raises(RenderError, match=f"{kind.narrowest_deg:.0f} to {kind.widest_deg:.0f}"):
            view(kind.name, hfov_deg, (640, 32))
    for hfov_deg in fields(kind):
        assert np.isfinite(view(kind.name, hfov_deg, (640, 32)).focal_px)


def test_views_higher_than_their_projection_are_refused_with_the_height_that_is_possible() -> None:
    with pytest.raises(
        RenderError, match=r"180 degrees of equirectangular views.* most 640 pixels"
    ):
        Viewport((1280, 720), 360, "equirectangular")
    assert Viewport((1280, 640), 360, "equirectangular").vfov_deg == pytest.approx(180)
    with pytest.raises(RenderError, match="at most 320 pixels"):
        Viewport((1280, 321), 360, "strip")


def test_views_that_must_fit_get_the_nearest_field_that_is_possible() -> None:
    assert fitting((640, 320), 400, "cylindrical").hfov_deg == 360
    assert fitting((640, 320), 5, "pannini").hfov_deg == 10
    assert fitting((640, 320), 90, "perspective").hfov_deg == 90
    high = fitting((1280, 720), 360, "equirectangular")
    assert high.hfov_deg == pytest.approx(320)
    assert high.vfov_deg == pytest.approx(180)
    with pytest.raises(RenderError, match="at most 640 pixels"):
        fitting((1280, 720), 360, "strip")


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
def test_the_documentation_has_its_limits(kind: Projection) -> None:
    page = (Path(__file__).parent.parent / "docs" / "views.md").read_text("utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| `{kind.name}` | 1"))
    limits = f"{kind.narrowest_deg} to {kind.widest_deg}"
    limits += "" if kind.tallest_deg is None else f", at most {kind.tallest_deg} high"
    assert limits in row


def test_unknown_projections_are_told_the_known_ones() -> None:
    with pytest.raises(RenderError, match=r"unknown projection 'fishy'.*perspective, pannini"):
        Viewport((640, 480), 90, "fishy")


def test_a_crop_has_no_rays_of_its_own() -> None:
    with pytest.raises(RenderError, match="depends on the lens"):
        Viewport((640, 480), 90, "crop").rays()
