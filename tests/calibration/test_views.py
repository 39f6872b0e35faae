"""Views that cannot be used are said, one sentence each."""

from __future__ import annotations

import re

import numpy as np
import pytest
from boards import BOARD
from scipy.spatial.transform import Rotation

from freelook.calibration.views import Pose, View, checked
from freelook.errors import CalibrationError
from freelook.lens import Floats

SIZE = (640, 480)


def view(
    name: str = "a.jpg", points: Floats = BOARD, pixels: Floats | None = None, shift: float = 0.0
) -> View:
    if pixels is None:
        pixels = points[:, :2] * 1500 + 20 + shift
    return View(name, points, pixels)


def changed(values: Floats, row: int, to: Floats | float) -> Floats:
    values = values.copy()
    values[row] = to
    return values


def test_good_views_are_all_used() -> None:
    used, dropped = checked([view("a"), view("b", shift=3.0)], SIZE)
    assert [v.name for v in used] == ["a", "b"]
    assert dropped == ()


FAULTS = [
    (view(points=BOARD[:5]), "5 points; a view needs at least 6"),
    (view(points=BOARD[:9]), "its points lie on one line"),
    (
        view(points=BOARD + np.outer(np.sin(np.arange(54.0)), [0, 0, 0.01])),
        "its points are not in one plane; use a flat target",
    ),
    (view(points=changed(BOARD, 3, BOARD[7])), "1 of its points of the target are listed more"),
    (view(pixels=changed(view().pixels, 3, view().pixels[7])), "1 of its pixels are listed more"),
    (view(pixels=changed(view().pixels, 3, np.nan)), "some of its points are not numbers"),
]


@pytest.mark.parametrize(("bad", "why"), FAULTS, ids=[why for _, why in FAULTS])
def test_a_view_with_a_fault_is_left_out_and_said(bad: View, why: str) -> None:
    used, dropped = checked([view("good.jpg"), bad], SIZE)
    assert [v.name for v in used] == ["good.jpg"]
    ((name, said),) = dropped
    assert name == "a.jpg"
    assert said.startswith(why)


@pytest.mark.parametrize(("bad", "why"), FAULTS, ids=[why for _, why in FAULTS])
def test_if_no_view_is_left_the_fault_is_the_error(bad: View, why: str) -> None:
    with pytest.raises(CalibrationError, match=re.escape(f"a.jpg: {why}")):
        checked([bad], SIZE)


def test_no_views_at_all() -> None:
    with pytest.raises(CalibrationError, match="no view of the target"):
        checked([], SIZE)


def test_a_picture_given_twice_counts_once() -> None:
    """Otherwise it would be tested on itself."""
    used, dropped = checked([view("a"), view("b", shift=1.0), view("a again")], SIZE)
    assert [v.name for v in used] == ["a", "b"]
    assert dropped == (("a again", "the same picture as a"),)


def test_points_outside_the_picture_stop_everything() -> None:
    """One view of another size means that something is wrong with the set."""
    with pytest.raises(CalibrationError, match=r"far\.jpg: 54 points lie outside .* 640 x 480"):
        checked([view(), view("far.jpg", shift=700.0)], SIZE)


def test_points_and_pixels_must_go_together() -> None:
    with pytest.raises(CalibrationError, match=r"\(54, 3\) points do not go with \(53, 2\)"):
        checked([View("a.jpg", BOARD, view().pixels[:53])], SIZE)


def test_a_flat_target_may_stand_anywhere() -> None:
    tilted = Pose(Rotation.from_rotvec([0.4, -0.3, 0.2]), np.array([5.0, 0.1, -3.0])).apply(BOARD)
    used, dropped = checked([View("a", tilted, view().pixels)], SIZE)
    assert len(used) == 1
    assert dropped == ()


def test_a_pose_turns_then_shifts() -> None:
    pose = Pose(Rotation.from_rotvec([0, 0, np.pi / 2]), np.array([1.0, 2.0, 3.0]))
    assert pose.apply(np.array([[1.0, 0.0, 0.0]])) == pytest.approx(np.array([[1.0, 3.0, 3.0]]))
