"""Targets in simulated fisheye pictures: found, numbered rightly, exactly placed, or refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from boards import sigmas_off
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from simulated_boards import FISHEYE, Gray, Light, Print, held, printed

from freelook.calibration.calibrate import calibrate
from freelook.calibration.drawing import Drawing
from freelook.calibration.targets import (
    AprilGrid,
    Charuco,
    Chessboard,
    Circles,
    Target,
    parse_target,
    simple_target,
)
from freelook.calibration.views import Pose, View
from freelook.camera import make_camera
from freelook.errors import CalibrationError
from freelook.lens import Equidistant, Floats
from freelook.simulation.camera import SimulatedCamera

SIZE = FISHEYE.camera.size
CHARUCO = Charuco((9, 7), 0.03, 0.0225)
CIRCLES = Circles(0.03, (9, 7))
ASYMMETRIC = Circles(0.02, (4, 11), asymmetric=True)
APRILGRID = AprilGrid((6, 5), 0.04)
CHESSBOARD = Chessboard(0.03, (8, 6))
TARGETS: dict[str, Target] = {
    "charuco": CHARUCO,
    "circles": CIRCLES,
    "acircles": ASYMMETRIC,
    "aprilgrid": APRILGRID,
    "chessboard": CHESSBOARD,
}
# Towards (right, down) degrees, distance in metres, tilts: in the middle, to the right edge, cut by
# the lens's rim at the left, cut by the picture's lower edge.
POSES = (
    ((18.0, 8.0), 0.17, (22.0, -25.0, 30.0)),
    ((66.0, -10.0), 0.15, (-10.0, 15.0, 10.0)),
    ((-76.0, 12.0), 0.13, (5.0, -12.0, 97.0)),
    ((35.0, 52.0), 0.15, (12.0, 8.0, -150.0)),
)
# What a point needs around it: what it is placed by, and circles as far again beyond their edge.
AROUND_PX = {"charuco": 8, "circles": 26, "acircles": 26, "aprilgrid": 8, "chessboard": 14}
# What is measured over 28 other poses with light like this: median 0.013 (circles, every other row
# shifted) to 0.021 px (ChArUco), 95 % within 0.038 (chessboard) to 0.067 px (circles), the worst
# 0.08 to 0.6 px: four poses may be half as bad again.
MEDIAN_PX, MOST_PX = 0.03, 0.11
# Where a target is seen edge on, its points are worse; never by more than an edge is blurred.
FARTHEST_PX = 0.6


@dataclass(frozen=True)
class Shot:
    """A picture, how the target was held, and where its points were."""

    gray: Gray
    pose: Pose
    pixels: Floats


def paper(target: Target) -> Print:
    """The print of a target, placed so that its points are where `points` has them."""
    drawing = target.drawing
    if isinstance(target, AprilGrid):
        edge = 2 * target.spacing * target.tag
        return printed(drawing, (-edge, drawing.size[1] - edge), up=True)
    if isinstance(target, Circles):
        edge = 0.75 * target.spacing * (np.sqrt(2) if target.asymmetric else 1)
    else:
        assert isinstance(target, Charuco | Chessboard)
        edge = target.square * (0.5 if isinstance(target, Charuco) else 2.0)
    return printed(drawing, (-edge, -edge))


@cache
def shot(kind: str, number: int) -> Shot:
    target = TARGETS[kind]
    on_paper = paper(target)
    pose = held(on_paper, *POSES[number])
    rng = np.random.default_rng(number)
    gray = FISHEYE.photograph(pose, on_paper, Light(fall_off=0.3), rng)
    return Shot(gray, pose, FISHEYE.seen(pose, target.points))


@cache
def found(kind: str, number: int) -> View:
    view = TARGETS[kind].find(shot(kind, number).gray, "picture")
    assert view is not None
    return view


def numbers_of(target: Target, view: View, pixels: Floats) -> NDArray[np.int64]:
    """Which of the target's points each of the view's is.

    Points that cannot be told from each other are numbered from where the view's lie: all of them
    must then be the target's, turned by quarters and moved as one, and not mirrored.
    """
    if target.named:
        distance, numbers = cKDTree(target.points).query(view.points)
        assert distance.max() < 1e-9
        return np.asarray(numbers)
    seen = np.where(np.isfinite(pixels), pixels, -1e6)
    numbers = cKDTree(seen).query(view.pixels)[1]
    assert len(set(numbers)) == len(numbers)
    ours, right = (p[:, :2] - p[:, :2].mean(axis=0) for p in (view.points, target.points[numbers]))
    turn = np.linalg.lstsq(ours, right, rcond=None)[0]
    np.testing.assert_allclose(turn @ turn.T, np.eye(2), atol=1e-9)
    assert np.linalg.det(turn) > 0
    np.testing.assert_allclose(ours @ turn, right, atol=1e-9)
    return np.asarray(numbers)


def errors_of(target: Target, view: View, pixels: Floats) -> Floats:
    return np.asarray(
        np.linalg.norm(view.pixels - pixels[numbers_of(target, view, pixels)], axis=1)
    )


kinds = pytest.mark.parametrize("kind", TARGETS)


@kinds
def test_points_are_found_where_they_are(kind: str) -> None:
    target, errors, farthest = TARGETS[kind], [], 0.0
    for number in range(len(POSES)):
        taken, view = shot(kind, number), found(kind, number)
        assert len(view.pixels) >= 0.97 * FISHEYE.inside(taken.pixels, AROUND_PX[kind]).sum()
        errors.append(errors_of(target, view, taken.pixels))
        rays = taken.pose.apply(target.points[numbers_of(target, view, taken.pixels)])
        angles = np.degrees(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]))
        farthest = max(farthest, float(angles.max()))
    off = np.concatenate(errors)
    assert farthest > 90
    assert np.median(off) < MEDIAN_PX
    assert np.percentile(off, 95) < MOST_PX
    assert off.max() < FARTHEST_PX


@kinds
def test_upside_down(kind: str) -> None:
    """The same points, at the same places of the picture that is turned by half a turn."""
    taken, target = shot(kind, 0), TARGETS[kind]
    view = target.find(np.ascontiguousarray(taken.gray[::-1, ::-1]), "turned")
    assert view is not None
    assert len(view.pixels) == len(found(kind, 0).pixels)
    turned = np.array(SIZE) - 1 - taken.pixels
    assert np.percentile(errors_of(target, view, turned), 95) < MOST_PX


@kinds
def test_mirrored_pictures_are_not_numbered_wrongly(kind: str) -> None:
    """Markers cannot be read mirrored; a mirrored chessboard or grid of circles is one as well."""
    target = TARGETS[kind]
    view = target.find(np.ascontiguousarray(shot(kind, 0).gray[:, ::-1]), "mirrored")
    if target.named:
        assert view is None
    else:
        assert view is not None
        assert clockwise(view)


def clockwise(view: View) -> bool:
    """Whether y is clockwise of x in the picture, as it is on paper."""
    ours = view.points[:, :2] - view.points[:, :2].mean(axis=0)
    seen = view.pixels - view.pixels.mean(axis=0)
    return bool(np.linalg.det(np.linalg.lstsq(ours, seen, rcond=None)[0]) > 0)


@kinds
def test_partly_hidden(kind: str) -> None:
    """A dark thing over the upper middle: the rest is found, and rightly numbered."""
    target = TARGETS[kind]
    on_paper = paper(target).hidden(0.3, 0.0, 0.5, 0.55)
    pose = held(on_paper, *POSES[0])
    pixels = FISHEYE.seen(pose, target.points)
    view = target.find(FISHEYE.photograph(pose, on_paper), "hidden")
    assert view is not None
    x, y = on_paper.texels(target.points[:, :2]).T / np.array(on_paper.texture.shape)[::-1, None]
    numbers = numbers_of(target, view, pixels)
    assert not ((x > 0.3) & (x < 0.5) & (y < 0.55))[numbers].any()
    near = 0.07  # half a circle, a square, or a tag's space: points that are partly hidden
    visible = ~((x > 0.3 - near) & (x < 0.5 + near) & (y < 0.55 + near))
    assert len(numbers) >= 0.97 * visible.sum()
    assert np.percentile(errors_of(target, view, pixels), 95) < MOST_PX


@kinds
def test_blurred_and_noisy(kind: str) -> None:
    target = TARGETS[kind]
    on_paper = paper(target)
    pose = held(on_paper, (15.0, -12.0), 0.13, (15.0, 20.0, -20.0))
    light = Light(black=50, white=130, blur_px=1.5, noise=5.0)
    view = target.find(FISHEYE.photograph(pose, on_paper, light), "dim")
    assert view is not None
    assert len(view.pixels) >= 0.95 * len(target.points)
    errors = errors_of(target, view, FISHEYE.seen(pose, target.points))
    # noise of 5 in steps of 80 grey levels: eight times that of the other pictures
    assert np.median(errors) < 0.2


# --- nothing where nothing is


def nothing(name: str) -> Gray:
    rng = np.random.default_rng(7)
    rows_first = (270, 360)
    noise = rng.normal(128, 60, rows_first)
    if name == "world":
        camera = make_camera((480, 360), Equidistant(130.0), field_deg=200)
        return np.ascontiguousarray(SimulatedCamera(camera).picture(0).planes[0])
    if name == "clouds":
        noise = 128 + 12 * cv2.GaussianBlur(rng.normal(0, 60, rows_first), (0, 0), 5)
    elif name == "stripes":
        noise = np.where(np.indices(rows_first).sum(axis=0) // 12 % 2 == 0, 40.0, 200.0)
    elif name == "black":
        noise = 0 * noise
    return np.asarray(np.clip(noise, 0, 255), np.uint8)


@pytest.mark.parametrize("name", ["noise", "clouds", "stripes", "black", "world"])
def test_nothing_is_found_where_nothing_is(name: str) -> None:
    gray = nothing(name)
    targets: list[Target] = [CHARUCO, APRILGRID, Chessboard(), Circles(), Circles(asymmetric=True)]
    for target in targets:
        assert target.find(gray, name) is None


def test_one_target_is_not_taken_for_another() -> None:
    """But for those that are each other: circles in rows are diagonal rows as well, and the corners
    of a ChArUco board are those of a chessboard."""
    others: dict[str, list[Target]] = {
        "charuco": [CIRCLES, APRILGRID, Charuco((9, 7), 0.03, 0.0225, "4x4_100")],
        "circles": [CHARUCO, APRILGRID, CHESSBOARD],
        "acircles": [CHARUCO, APRILGRID, CHESSBOARD],
        "aprilgrid": [CHARUCO, CIRCLES, ASYMMETRIC, CHESSBOARD],
        "chessboard": [CHARUCO, CIRCLES, ASYMMETRIC, APRILGRID],
    }
    for kind, targets in others.items():
        for target in targets:
            assert target.find(shot(kind, 0).gray, kind) is None, (kind, target.text)


# --- beside OpenCV


def charuco_corners(board: cv2.aruco.CharucoBoard, gray: Gray) -> int:
    corners, *_ = cv2.aruco.CharucoDetector(board).detectBoard(gray)
    return 0 if corners is None else len(corners)


def test_more_charuco_corners_than_opencv() -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
    board = cv2.aruco.CharucoBoard((9, 7), 0.03, 0.0225, dictionary)
    ours = [len(found("charuco", k).pixels) for k in range(len(POSES))]
    theirs = [charuco_corners(board, shot("charuco", k).gray) for k in range(len(POSES))]
    assert all(a >= b for a, b in zip(ours, theirs, strict=True)), (ours, theirs)
    assert sum(ours) > sum(theirs) > 0


@pytest.mark.parametrize("kind", ["circles", "acircles"])
def test_circles_on_more_pictures_than_opencv(kind: str) -> None:
    target = TARGETS[kind]
    assert isinstance(target, Circles)
    flags = cv2.CALIB_CB_ASYMMETRIC_GRID if target.asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    theirs = [
        cv2.findCirclesGrid(shot(kind, k).gray, target.count, flags=flags)[0]
        for k in range(len(POSES))
    ]
    assert all(len(found(kind, k).pixels) > 20 for k in range(len(POSES)))
    assert sum(theirs) < len(POSES)  # it takes whole grids only


# --- as they are printed elsewhere


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("squares", [(8, 5), (5, 6)])
@pytest.mark.parametrize("name", ["4x4_50", "6x6_250", "apriltag_36h11"])
def test_charuco_boards_of_opencv(squares: tuple[int, int], legacy: bool, name: str) -> None:
    target = Charuco(squares, 0.03, 0.021, name)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name.upper()}"))
    board = cv2.aruco.CharucoBoard(squares, 0.03, 0.021, dictionary)
    board.setLegacyPattern(legacy)
    per_square = 60
    drawn = board.generateImage((squares[0] * per_square, squares[1] * per_square))
    gray = cv2.copyMakeBorder(drawn, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=(255,))
    view = target.find(np.asarray(cv2.GaussianBlur(gray, (0, 0), 1.0), np.uint8), "print")
    assert view is not None
    assert len(view.pixels) == len(target.points)
    # the board's corner is that of pixel (40, 40)
    np.testing.assert_allclose(view.points[:, :2] / 0.03 * 60 + 39.5, view.pixels, atol=0.02)


def raster(drawing: Drawing, per_unit: float) -> Gray:
    """A drawing whose edges fall between pixels."""
    columns, rows = (round(length * per_unit) for length in drawing.size)
    gray = np.full((rows, columns), 255, np.uint8)
    for x, y, width, height in np.round(drawing.rectangles * per_unit).astype(int):
        gray[y : y + height, x : x + width] = 0
    return gray


def test_charuco_is_drawn_as_opencv_draws_it() -> None:
    target = Charuco((5, 4), 7.0, 5.0, "5x5_50")
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    theirs = cv2.aruco.CharucoBoard((5, 4), 7.0, 5.0, dictionary).generateImage((5 * 70, 4 * 70))
    ours = raster(target.drawing, 10.0)[35:-35, 35:-35]
    # it rounds the size of a marker's bits to whole pixels
    assert np.mean(ours != theirs) < 0.02


def test_aprilgrid_is_drawn_as_kalibr_draws_it() -> None:
    """The family's first code, most significant bit first from the top left, light where it is 1,
    within two dark bits; at the bottom left, with dark squares at its corners."""
    target = AprilGrid((3, 2), 10.0, 0.3)
    gray = raster(target.drawing, 10.0)
    edge = 60  # the margin: two spaces
    first = gray[-edge - 100 : -edge, edge : edge + 100][5::10, 5::10] > 0
    bits = [bool(0xD5D628584 >> (35 - k) & 1) for k in range(36)]
    np.testing.assert_array_equal(first[2:-2, 2:-2].ravel(), bits)
    assert not first[[0, 1, -2, -1]].any()
    assert not first[:, [0, 1, -2, -1]].any()
    for x in (edge - 30, edge + 100):
        for y in (len(gray) - edge, len(gray) - edge - 130):
            assert not gray[y : y + 30, x : x + 30].any()
    assert gray[len(gray) - edge - 50, edge - 15] == 255
    np.testing.assert_allclose(target.points[:3, :2], [[0, 0], [10, 0], [13, 0]])
    np.testing.assert_allclose(target.points[6, :2], [0, 10])


def test_aprilgrid_with_thin_borders() -> None:
    """Other programs print one dark bit around a tag."""
    target = AprilGrid((3, 2), 0.04)
    on_paper = paper(target)
    texture, size = on_paper.texture.copy(), round(target.tag * on_paper.per_unit)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    for number, corner in enumerate(
        target.points.reshape(2, 2, 3, 2, 3)[:, 1, :, 0].reshape(-1, 3)
    ):
        x, y = np.round(on_paper.texels(corner[:2]) + 0.5).astype(int)
        marker = cv2.aruco.generateImageMarker(dictionary, number, size, borderBits=1)
        texture[y : y + size, x : x + size] = marker[::-1, ::-1] / 255
    thin = Print(texture, on_paper.per_unit, on_paper.corner, up=True)
    pose = held(thin, (10.0, 5.0), 0.12, (10.0, 5.0, 20.0))
    view = target.find(FISHEYE.photograph(pose, thin), "thin")
    assert view is not None
    assert len(view.pixels) == 24
    assert errors_of(target, view, FISHEYE.seen(pose, target.points)).max() < 0.3


# --- as they are written


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("chessboard", Chessboard()),
        ("chessboard:9x6:0.025", Chessboard(0.025, (9, 6))),
        ("chessboard:0.03", Chessboard(0.03)),
        ("charuco:9x7:0.024:0.018", Charuco((9, 7), 0.024, 0.018)),
        ("charuco:9x7:0.024:0.018:4x4_100", Charuco((9, 7), 0.024, 0.018, "4x4_100")),
        ("circles", Circles()),
        ("circles:9x6:0.025", Circles(0.025, (9, 6))),
        ("acircles:4x11:0.02:0.012", Circles(0.02, (4, 11), True, 0.012)),
        ("aprilgrid:6x6:0.088", AprilGrid((6, 6), 0.088)),
        ("aprilgrid:6x6:0.088:0.25", AprilGrid((6, 6), 0.088, 0.25)),
    ],
)
def test_targets_in_words(text: str, target: Target) -> None:
    assert parse_target(text) == target
    assert parse_target(target.text) == target


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("paper", "unknown target 'paper'; give one of: chessboard.*, charuco.*, aprilgrid"),
        ("chessboard:9x6:wide", "chessboard:9x6:wide' is not chessboard.*example"),
        ("chessboard:9x6:0.02:0.03", "is not chessboard"),
        ("chessboard:2x2:0.02", "2 x 2 inner corners are too few"),
        ("chessboard:9x6:-1", "must be positive"),
        ("charuco:9x7:0.024", "is not charuco"),
        ("charuco:9x7:0.018:0.024", "markers of 0.024 do not fit into squares of 0.018"),
        ("charuco:9x7:0.024:0.018:9x9", "unknown marker dictionary '9x9'; known: 4x4_50"),
        ("charuco:12x12:0.024:0.018:4x4_50", "take 73 markers, 4x4_50 has 50"),
        ("charuco:2x7:0.024:0.018", "2 x 7 squares are too few"),
        ("circles:9:6:0.02:1", "is not circles"),
        ("circles:9x6:0", "must be positive"),
        ("aprilgrid:6x6", "is not aprilgrid"),
        ("aprilgrid:40x40:0.02", "40 x 40 tags: there are 1 to 587"),
        ("aprilgrid:6x6:0.02:2", "the space 0 to 1"),
        ("missing.yaml", "missing.yaml: No such file"),
    ],
)
def test_words_that_are_no_target(text: str, said: str) -> None:
    with pytest.raises(CalibrationError, match=said):
        parse_target(text)


def test_targets_of_usual_proportions() -> None:
    assert simple_target("chessboard", None, None) == Chessboard()
    assert simple_target("chessboard", (9, 6), 0.02) == Chessboard(0.02, (9, 6))
    assert simple_target("charuco", (9, 7), 0.02) == Charuco((9, 7), 0.02, 0.015)
    assert simple_target("circles", (9, 7), 0.02) == Circles(0.02, (9, 7))
    assert simple_target("acircles", (4, 11), 0.02) == Circles(0.02, (4, 11), asymmetric=True)
    assert simple_target("aprilgrid", (6, 6), 0.02) == AprilGrid((6, 6), 0.02)
    for kind in ("charuco", "aprilgrid"):
        with pytest.raises(CalibrationError, match=f"--board COLUMNSxROWS, or --target {kind}"):
            simple_target(kind, None, None)
    with pytest.raises(CalibrationError, match="must be positive"):
        simple_target("circles", None, 0.0)


KALIBR: dict[str, tuple[str, Target]] = {
    "aprilgrid": (
        "target_type: aprilgrid\ntagCols: 6\ntagRows: 5\ntagSize: 0.088\ntagSpacing: 0.3\n",
        AprilGrid((6, 5), 0.088, 0.3),
    ),
    "checkerboard": (
        "target_type: checkerboard\ntargetCols: 6\ntargetRows: 7\n"
        "rowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n",
        Chessboard(0.06, (6, 7)),
    ),
    "circlegrid": (
        "target_type: circlegrid\ntargetCols: 6\ntargetRows: 7\nspacingMeters: 0.02\n"
        "asymmetricGrid: true\n",
        Circles(0.02, (6, 7), asymmetric=True),
    ),
}


@pytest.mark.parametrize("kind", KALIBR)
def test_target_files_of_kalibr(kind: str, tmp_path: Path) -> None:
    text, target = KALIBR[kind]
    (tmp_path / "target.yaml").write_text(text)
    assert parse_target(str(tmp_path / "target.yaml")) == target


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("target_type: paper\n", "target_type is 'paper'; known: aprilgrid, checkerboard, circle"),
        ("- 1\n", "target_type is None"),
        ("target_type: aprilgrid\ntagCols: 6\n", "of type aprilgrid has no 'tagRows'"),
        ("target_type: aprilgrid\ntagCols: [\n", "not YAML"),
        (
            KALIBR["checkerboard"][0].replace("rowSpacingMeters: 0.06", "rowSpacingMeters: 1"),
            "squar",
        ),
    ],
)
def test_files_that_are_no_target(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "target.yaml").write_text(text)
    with pytest.raises(CalibrationError, match=f"target.yaml: .*{said}"):
        parse_target(str(tmp_path / "target.yaml"))


@pytest.mark.parametrize("target", [Chessboard(), Circles(), Circles(asymmetric=True)])
def test_targets_of_unknown_size_are_not_drawn(target: Target) -> None:
    ask: list[Callable[[], object]] = [lambda: target.drawing, lambda: target.points]
    for attribute in ask:
        with pytest.raises(CalibrationError, match="give COLUMNSxROWS"):
            attribute()
    with pytest.raises(CalibrationError, match="run into each other"):
        _ = Circles(0.02, (4, 3), diameter=0.02).drawing


@kinds
def test_drawings_have_light_margins(kind: str) -> None:
    drawing = TARGETS[kind].drawing
    corners = [drawing.rectangles[:, :2], drawing.rectangles[:, :2] + drawing.rectangles[:, 2:]]
    middles, radii = drawing.circles[:, :2], drawing.circles[:, 2:]
    corners += [middles - radii, middles + radii]
    everything = np.concatenate(corners)
    assert len(everything) > 40
    assert (everything > 0.005).all()
    assert (everything < np.array(drawing.size) - 0.005).all()


# --- to the end


def test_a_camera_is_calibrated_from_each_target() -> None:
    """The true lens within its stated uncertainty, and from all of them together."""
    by_kind = {
        kind: [replace(found(kind, n), name=f"{kind} {n}") for n in range(len(POSES))]
        for kind in ("charuco", "circles", "acircles", "aprilgrid")
    }
    by_kind["all"] = [view for views in by_kind.values() for view in views]
    for kind, views in by_kind.items():
        calibration = calibrate(views, SIZE, "kannala_brandt")
        assert not calibration.dropped
        assert calibration.rms_px < 0.04, kind
        assert sigmas_off(FISHEYE.camera, calibration) < 4, kind
