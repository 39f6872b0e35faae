"""The figures of one lens show what the numbers say, the right way round."""

from __future__ import annotations

import numpy as np
import pytest
from drawn import image_of, panels
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelook.camera import Camera, make_camera
from freelook.lens import (
    MODELS,
    Equidistant,
    Equisolid,
    Lens,
    Orthographic,
    Perspective,
    ThinPrismFisheye,
)
from freelook.plots._picture import inside_view, outline
from freelook.plots.lens import NamedView, draw_by_angle, draw_curve, lens_figure
from freelook.resolution import ray_at
from freelook.rotations import body_from_view
from freelook.viewport import Viewport

FISHEYE = make_camera((960, 960), Equidistant(289.0), field_deg=188)
WIDE = Viewport((1280, 720), 90)


def looking(camera: Camera, yaw: float, pitch: float, name: str = "a view") -> NamedView:
    return NamedView(name, camera.camera_from_body * body_from_view(yaw, pitch), WIDE)


def empty_axes() -> Axes:
    return Figure().add_subplot()


def line(axes: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    (found,) = [each for each in axes.get_lines() if each.get_label() == label]
    return np.asarray(found.get_xdata()), np.asarray(found.get_ydata())


def texts(axes: Axes) -> list[str]:
    return [text.get_text() for text in axes.texts]


def test_the_curve_is_the_lens_s() -> None:
    axes = empty_axes()
    draw_curve(axes, FISHEYE)
    theta_deg, radius = line(axes, "equidistant")
    np.testing.assert_allclose(radius, 289 * np.radians(theta_deg))
    assert theta_deg[-1] == pytest.approx(94)
    names = {"perspective", "stereographic", "equidistant", "equisolid", "orthographic"}
    assert set(texts(axes)) == names
    assert "pixels" in axes.get_ylabel()
    assert "degrees" in axes.get_xlabel()


def test_resolution_by_angle_is_radial_and_tangential() -> None:
    axes = empty_axes()
    draw_by_angle(axes, FISHEYE)
    theta_deg, radial = line(axes, "away from it (radial)")
    np.testing.assert_allclose(radial, 289 * np.pi / 180, rtol=1e-6)
    _, tangential = line(axes, "around the axis (tangential)")
    # the mean of a constant: on the axis the limit is exact too
    expected = 289 * np.pi / 180 / np.sinc(theta_deg / 180)
    np.testing.assert_allclose(tangential[:-1], expected[:-1], rtol=1e-6)


def test_where_the_picture_ends_is_marked_only_if_it_ends_first() -> None:
    axes = empty_axes()
    draw_by_angle(axes, FISHEYE)
    assert texts(axes) == []
    draw_by_angle(axes, make_camera((640, 480), Perspective(400)))
    assert texts(axes) == ["picture ends: sides", "picture ends: top, bottom"]


def test_the_outline_of_a_view_to_the_left_lies_left_and_one_up_lies_above() -> None:
    left = outline(FISHEYE, looking(FISHEYE, -60, 0).camera_from_view, WIDE)
    assert np.nanmax(left[:, 0]) < FISHEYE.center[0]
    up = outline(FISHEYE, looking(FISHEYE, 0, 60).camera_from_view, WIDE)
    assert np.nanmax(up[:, 1]) < FISHEYE.center[1]


def test_inside_a_view_is_between_its_borders() -> None:
    turn = looking(FISHEYE, 0, 0).camera_from_view
    angles = np.radians([0, 44.9, 45.1, 90, 180])
    inside = inside_view(ray_at(angles, np.zeros(1)), turn, WIDE)
    assert (inside > 0).tolist() == [True, True, False, False, False]
    border = outline(FISHEYE, turn, WIDE)
    np.testing.assert_allclose(inside_view(FISHEYE.ray(border), turn, WIDE), 0, atol=1e-9)
    assert np.isnan(inside_view(np.full((1, 3), np.nan), turn, WIDE)).all()


def test_the_maps_lie_as_the_picture_does() -> None:
    """An equidistant lens is coarsest on its axis, here to the lower right of the middle."""
    camera = make_camera((400, 300), Equidistant(150), center=(300, 200), field_deg=150)
    figure = lens_figure(camera, "a lens", [looking(camera, -30, 0)])
    *_, over, where = panels(figure)
    assert [axes.get_title(loc="left") for axes in panels(figure)] == [
        "Radius by angle",
        "Resolution by angle",
        "Resolution over the picture",
        "Where the views lie",
    ]
    shown, extent = image_of(over)
    assert extent == [-0.5, 399.5, 299.5, -0.5]
    row, column = np.unravel_index(np.nanargmin(shown), shown.shape)
    height, width = shown.shape
    assert (column + 0.5) / width * 400 == pytest.approx(300, abs=10)
    assert (row + 0.5) / height * 300 == pytest.approx(200, abs=10)
    assert np.isnan(shown[0, 0])  # 75 degrees are 196 px; this corner is 360 away
    assert "30°" in texts(over)
    assert "60°" in texts(where)
    assert "90°" not in texts(where)


@pytest.mark.parametrize(
    "lens",
    [Orthographic(300), Perspective(300), ThinPrismFisheye(250, p1=0.003, sx1=0.002)],
    ids=lambda lens: type(lens).__name__,
)
def test_other_lenses_are_drawn_too(lens: Lens) -> None:
    camera = make_camera((800, 600), lens)
    figure = lens_figure(camera, "a lens", [looking(camera, 0, 0), looking(camera, 180, 0)])
    assert len(panels(figure)) == 4
    figure.draw_without_rendering()  # no warning, nothing empty


def test_a_map_of_one_value_does_not_show_its_rounding() -> None:
    """An equisolid lens has the same pixels per square degree everywhere."""
    (*_, over, _) = panels(lens_figure(make_camera((400, 400), Equisolid(150)), "a lens"))
    (image,) = over.get_images()
    low, high = image.get_clim()
    assert high == pytest.approx(1.05 * low)


def test_the_classical_names_are_models() -> None:
    from freelook.plots.lens import CLASSICAL

    assert set(CLASSICAL) < set(MODELS)
