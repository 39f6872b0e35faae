"""Crop and rectified view: where they look, what they cost, what a crop cannot do."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.paper import rig, views
from freelook.paper.views import FORWARD, LEFT, TILTED, Look
from freelook.resolution import resolution_at
from freelook.types import Picture


def coordinates_picture() -> np.ndarray:
    """(576, 720, 3): every pixel says its column (red: x / 4) and row (green: y / 4)."""
    y, x = np.mgrid[0:576, 0:720]
    return np.stack([x // 4, y // 4, np.zeros_like(x)], axis=-1).astype(np.uint8)


def test_a_crop_is_the_pixels_round_what_is_looked_at() -> None:
    image = coordinates_picture()
    for look in (FORWARD, LEFT):
        shown = views.crop(image, look)
        assert shown.shape == (144, 180, 3)
        middle = shown[72, 90, :2].astype(float) * 4
        assert np.abs(middle - look.axis_px).max() < 4


def test_a_crop_stays_inside_the_picture() -> None:
    for pitch in (-90.0, 90.0):
        x, y = views.window_corner(Look("up or down", 0, pitch))
        assert 0 <= x <= 720 - 180
        assert y == (0 if pitch > 0 else 576 - 144)
        assert views.crop(coordinates_picture(), Look("", 0, pitch)).shape == (144, 180, 3)


def test_a_crop_cannot_roll_and_a_rectified_view_does() -> None:
    assert views.window_corner(TILTED) == views.window_corner(FORWARD)
    gray = Picture("rgb24", (coordinates_picture(),))
    level, tilted = (views.rectified(gray, look).astype(int) for look in (FORWARD, TILTED))
    rows = level[180, 60:420, 1]  # the row of the horizon: level, so one row of the picture
    assert np.ptp(rows) <= 1
    assert np.ptp(tilted[180, 60:420, 1]) > 15


def test_rectified_view_has_straight_lines_where_the_crop_has_not() -> None:
    """A straight edge 18 degrees up, from left to right: where does it run in each?"""
    across = np.radians(np.linspace(-25, 25, 51))
    edge = np.stack([np.tan(across), np.full(51, -np.tan(np.radians(18))), np.ones(51)], axis=-1)
    in_crop = rig.camera().project(edge)
    assert np.ptp(in_crop[:, 1]) > 3  # bent by pixels in the crop
    in_view = views.RECTIFIED.focal_px * edge[:, 1] / edge[:, 2]
    assert np.ptp(in_view) < 1e-9
    # and the renderer looks there: the view's row under the edge sees the edge's pixels
    gray = Picture("rgb24", (coordinates_picture(),))
    view = views.rectified(gray, FORWARD)
    row = round(179.5 + in_view[0])
    columns = np.rint(239.5 + views.RECTIFIED.focal_px * edge[:, 0]).astype(int)
    seen = view[row, columns, 1].astype(float) * 4
    assert np.abs(seen - in_crop[:, 1]).max() < 6  # 4 from the picture's steps, 2 from rounding


def test_outline_of_a_view_lies_under_its_border() -> None:
    outline = views.view_outline(FORWARD)
    corner = views.RECTIFIED.rays()[0, 0]
    np.testing.assert_allclose(outline[0], rig.camera().project(corner), atol=1e-9)
    window = views.window_outline(FORWARD)
    assert np.ptp(window, axis=0).tolist() == [180, 144]


def test_crop_widths_in_degrees() -> None:
    across, down = views.window_fields_deg(FORWARD)
    # 2 asin(r / 2f) of half the window, to each side of the axis
    assert across == pytest.approx(2 * 2 * np.degrees(np.arcsin(90 / 2 / 176)), abs=0.02)
    assert down == pytest.approx(2 * 2 * np.degrees(np.arcsin(72 / 2 / 192)), abs=0.02)
    assert views.window_seen(FORWARD) == 1
    assert 0.4 < views.window_seen(Look("", -90)) < 0.6


def test_false_roll_of_a_crop() -> None:
    """None along the horizon; elsewhere the angle of a meridian at its place in the picture."""
    assert views.false_roll_deg(FORWARD) == pytest.approx(0, abs=1e-4)
    assert views.false_roll_deg(LEFT) == pytest.approx(0, abs=1e-4)
    yaw, pitch = np.radians(-60), np.radians([-40 - 1e-3, -40 + 1e-3])
    ray = np.stack(
        [np.cos(pitch) * np.sin(yaw), -np.sin(pitch), np.cos(pitch) * np.cos(yaw)], axis=-1
    )
    theta = np.arccos(ray[:, 2])
    place = (2 * 192 * np.sin(theta / 2) / np.sin(theta))[:, None] * ray[:, :2]
    right, down = place[1] - place[0]
    expected = np.degrees(np.arctan2(right, -down))
    assert abs(expected) > 20
    assert views.false_roll_deg(Look("", -60, -40)) == pytest.approx(expected, abs=0.01)


def test_costs_are_those_of_the_formulas() -> None:
    table, _ = views.costs()
    theta = np.radians([1e-6, 30, 60, 90])
    radial = 176 * np.cos(theta / 2) * np.radians(1)
    tangential = 2 * 192 * np.sin(theta / 2) / np.sin(theta) * np.radians(1)
    np.testing.assert_allclose(table["px/deg across"], radial, rtol=1e-5)
    np.testing.assert_allclose(table["px/deg down"], tangential, rtol=1e-5)
    np.testing.assert_allclose(table["crop squeezes to"], np.cos(theta / 2) ** 2, rtol=1e-5)
    line = views.along_the_horizon()
    at_40 = resolution_at(rig.camera(), np.array([-np.sin(0.7), 0, np.cos(0.7)]))
    near = np.interp(np.degrees(0.7), line["theta_deg"], line["across_px_per_deg"])
    assert near == pytest.approx(float(at_40.radial), rel=1e-3)


def test_a_gimbal_has_its_whole_sensor_for_the_view() -> None:
    assert views.gimbal_px_per_deg() == pytest.approx(360 / np.tan(np.radians(30)) * np.pi / 180)


def test_goggles_are_narrower_than_the_window() -> None:
    # 49.6 inches wide, 108 away
    assert np.tan(np.radians(views.GOGGLES_DEG / 2)) == pytest.approx(24.8 / 108)
    assert views.window_fields_deg(FORWARD)[0] > 2 * views.GOGGLES_DEG
